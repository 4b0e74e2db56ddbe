"""Supervision below the tree: every guard trips on what it is for, within one period, and on nothing else."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_bt.robot import (
    HOLD,
    BackendError,
    Command,
    GripperTarget,
    GuardTripped,
    JointSetpoint,
    Observation,
    ParamError,
    Pose,
    SafetyStop,
    StaleReading,
    TactileFrame,
)
from glotouch_bt.robot.fake import FakeRobot, forward
from glotouch_bt.robot.supervision import RECORDED, Supervisor
from glotouch_bt.robot.supervision_limits import GUARDS, Finding, SupervisionLimits

Spoil = Callable[[Observation], Observation]


class Device(FakeRobot):
    """A fake robot whose readings a test spoils from a cycle on; counts holds."""

    def __init__(self, spoil: Spoil | None = None, since: int = 0, until: int = 10**9, noise_N: float = 0.0) -> None:
        self._spoil, self._since, self._until, self._noise = spoil, since, until, noise_N
        self._rng = np.random.default_rng(7)
        self.holds = 0
        super().__init__()

    def cycle(self, command: Command) -> Observation:
        seen = super().cycle(command)
        if self._noise:
            wrench = seen.wrench_S + self._noise * self._rng.standard_normal(seen.wrench_S.shape)
            seen = dataclasses.replace(seen, wrench_S=wrench)
        if self._spoil is not None and self._since <= self.cycles - 1 < self._until:
            seen = self._spoil(seen)
        return seen

    def hold(self) -> None:
        self.holds += 1


def supervised(device: FakeRobot, **rules: float) -> tuple[Supervisor, list[Finding]]:
    found: list[Finding] = []
    robot = Supervisor(device, SupervisionLimits(**rules))  # type: ignore[arg-type]
    robot.on_finding = found.append
    return robot, found


def setpoint(q: Any, dq: Any = None) -> Command:
    q = np.asarray(q, dtype=np.float64)
    dq = np.zeros(7) if dq is None else np.asarray(dq, dtype=np.float64)
    return Command(JointSetpoint(q, dq, np.zeros(7), forward(FakeRobot().description, np.nan_to_num(q))))


def spin(robot: Supervisor, cycles: int, command: Command = HOLD) -> None:
    for _ in range(cycles):
        robot.cycle(command)


def with_part(name: str, row: int, column: int, value: float) -> Spoil:
    def spoil(seen: Observation) -> Observation:
        part = np.array(getattr(seen, name))
        part[row, column] = value
        return dataclasses.replace(seen, **{name: part})

    return spoil


def all_of(name: str, column: int, value: float) -> Spoil:
    def spoil(seen: Observation) -> Observation:
        part = np.array(getattr(seen, name))
        part[:, column] = value
        return dataclasses.replace(seen, **{name: part})

    return spoil


def jaws(**changes: Any) -> Spoil:
    return lambda seen: dataclasses.replace(seen, gripper=dataclasses.replace(seen.gripper, **changes))


def stamps(change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]) -> Spoil:
    return lambda seen: dataclasses.replace(seen, stamp_s=change(np.array(seen.stamp_s)))


FATAL: list[tuple[str, Spoil]] = [
    ("not_finite", all_of("wrench_S", 2, np.nan)),
    ("not_finite", all_of("q", 3, np.inf)),
    ("not_finite", jaws(aperture_m=float("nan"))),
    ("stamps", stamps(lambda s: s[0] + 0.0 * s)),
    ("stamps", stamps(lambda s: s - 1.0)),
    ("joint_range", all_of("q", 1, 2.9)),
    ("joint_speed", all_of("dq", 6, 3.5)),
    ("out_of_reach", all_of("position_B_P", 0, 7.0)),
    ("out_of_reach", all_of("quat_B_P", 2, 0.9)),
    ("wrench", all_of("wrench_S", 0, 31.0)),
    ("wrench", all_of("wrench_S", 4, -10.5)),
    ("following", all_of("position_B_P", 2, 0.2)),
    ("gripper_stale", jaws(stamp_s=-5.0)),
]


@pytest.mark.parametrize(("guard", "spoil"), FATAL, ids=lambda v: v if isinstance(v, str) else "")
def test_each_guard_holds_the_arm_within_the_period_and_is_on_record(guard: str, spoil: Spoil) -> None:
    device = Device(spoil, since=20)
    robot, found = supervised(device)
    if guard == "following":
        robot.cycle(setpoint(device.description.home_q))
    with pytest.raises(GuardTripped) as trip:
        spin(robot, 30)
    assert trip.value.guard == guard
    assert device.cycles <= 21 + (6 if "finite" in guard else 0), "not in the period in which it was wrong"
    assert device.holds == 1
    assert found[-1].guard == guard
    assert found[-1].fatal
    assert guard in GUARDS
    assert np.isnan(trip.value.value) or trip.value.value != trip.value.limit
    assert str(trip.value.stamp_s)[:4] in str(trip.value) or trip.value.stamp_s > 0
    # from now on it only holds, and raises the same again
    commands = len(device.commands)
    with pytest.raises(GuardTripped) as again:
        robot.cycle(setpoint(np.zeros(7)))
    assert again.value is trip.value
    assert device.commands[commands:] == [HOLD]


@pytest.mark.parametrize("part", ["q", "dq", "wrench_S", "position_B_P", "quat_B_P"])
def test_single_samples_that_are_no_numbers_are_dropped(part: str) -> None:
    device = Device(with_part(part, 4, 0, np.nan), since=5, until=6)
    robot, found = supervised(device)
    for k in range(20):
        seen = robot.cycle(HOLD)
        assert len(seen.stamp_s) == (9 if k == 5 else 10)
        assert all(np.isfinite(getattr(seen, p)).all() for p in ("q", "dq", "wrench_S", "position_B_P", "quat_B_P"))
    assert [f.guard for f in found] == ["not_finite"]
    assert not found[0].fatal
    assert part in found[0].what


def test_a_sample_out_of_order_is_dropped() -> None:
    def swap(s: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        s[[3, 4]] = s[[4, 3]]
        return s

    robot, found = supervised(Device(stamps(swap), since=5, until=6))
    blocks = [robot.cycle(HOLD) for _ in range(10)]
    s = np.concatenate([b.stamp_s for b in blocks])
    assert (np.diff(s) > 0).all()
    assert {f.guard for f in found} == {"stamps"}


def test_patience_ends() -> None:
    robot, found = supervised(Device(with_part("wrench_S", 0, 0, np.nan), since=5))
    with pytest.raises(GuardTripped) as trip:
        spin(robot, 50)
    assert trip.value.guard == "not_finite"
    assert sum(not f.fatal for f in found) == SupervisionLimits().tolerated


def test_rare_findings_never_end_patience_and_do_not_flood_the_record() -> None:
    class Rare(Device):
        def cycle(self, command: Command) -> Observation:
            self._since = self._until = -1
            if self.cycles % 50 == 7:
                self._since, self._until = 0, 10**9
            return super().cycle(command)

    robot, found = supervised(Rare(with_part("dq", 9, 2, np.nan)))
    for _ in range(50 * (RECORDED + 10)):
        robot.cycle(HOLD)
    assert robot.counts == {"not_finite": RECORDED + 10}
    assert len(found) == RECORDED


def missing(count: int) -> Spoil:
    def spoil(seen: Observation) -> Observation:
        names = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
        return dataclasses.replace(seen, **{n: getattr(seen, n)[: len(seen.stamp_s) - count] for n in names})

    return spoil


def test_missing_samples_are_put_on_record_and_then_end_it() -> None:
    robot, found = supervised(Device(missing(1)))
    spin(robot, 30)
    assert found == [], "real devices give nine to eleven of ten"
    robot, found = supervised(Device(missing(2), since=5, until=7))
    spin(robot, 30)
    assert {f.guard for f in found} == {"samples_missing"}
    robot, found = supervised(Device(missing(6), since=5))
    with pytest.raises(GuardTripped, match="samples_missing"):
        spin(robot, 30)


class Late(Device):
    """Its clock runs on: so many extra periods pass in one cycle."""

    def __init__(self, extra: int, at: int) -> None:
        self._extra, self._at = extra, at
        super().__init__()

    def cycle(self, command: Command) -> Observation:
        if self.cycles == self._at:
            for _ in range(self._extra):
                super().cycle(HOLD)
        return super().cycle(command)


def move(k: int, home: Any) -> Command:
    return setpoint(np.array(home) + 0.001 * k * np.eye(7)[6], 0.1 * np.eye(7)[6])


def test_a_gap_ends_a_motion_but_not_a_rest() -> None:
    device = Late(10, 5)
    robot, found = supervised(device)
    spin(robot, 20)
    assert [f.guard for f in found] == ["overrun", "samples_missing"][: len(found)]
    device = Late(10, 5)
    robot, _ = supervised(device)
    for k in range(5):
        robot.cycle(move(k + 1, device.description.home_q))
    with pytest.raises(GuardTripped, match="overrun"):
        robot.cycle(move(6, device.description.home_q))


def test_how_many_samples_a_period_has_is_learnt_from_the_first_block_of_several() -> None:
    class Single(Device):
        """As a driver that answers with one sample when it is opened."""

        def observe(self) -> Observation:
            seen = super().observe()
            names = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
            return seen if self.cycles else dataclasses.replace(seen, **{n: getattr(seen, n)[-1:] for n in names})

    robot, found = supervised(Single(missing(6), since=5))
    spin(robot, 5)
    assert found == []
    with pytest.raises(GuardTripped, match="6 of 10 samples are missing"):
        spin(robot, 5)


def test_an_arm_that_moves_while_it_is_held_is_noticed() -> None:
    def drift(seen: Observation) -> Observation:
        return dataclasses.replace(
            seen, position_B_P=seen.position_B_P + [[0.0, 0.002, 0.0]] * np.maximum(seen.stamp_s[:, None] - 0.2, 0.0)
        )

    device = Device(drift)
    robot, _ = supervised(device)
    robot.cycle(setpoint(device.description.home_q))
    with pytest.raises(GuardTripped, match="told to stay") as trip:
        spin(robot, 1000)
    limit = SupervisionLimits().following_m
    assert limit < trip.value.value < limit * 1.02


def test_an_arm_that_lags_in_motion_is_let_go_on() -> None:
    """A servo's delay of 50 ms at half of a joint's speed is no following error."""
    device = Device()
    queue: list[Command] = [HOLD] * 5

    class Lagging(Device):
        def cycle(self, command: Command) -> Observation:
            queue.append(command)
            return super().cycle(queue.pop(0))

    device = Lagging()
    robot, found = supervised(device)
    home = np.array(device.description.home_q)
    for k in range(100):
        robot.cycle(setpoint(home + 0.0125 * k * np.eye(7)[6], 1.25 * np.eye(7)[6]))
    assert found == []


def test_a_noisy_sensor_that_freezes_is_stuck() -> None:
    frozen: list[np.ndarray[Any, Any]] = []

    def freeze(seen: Observation) -> Observation:
        frozen.append(np.tile(seen.wrench_S[-1], (10, 1)))
        return dataclasses.replace(seen, wrench_S=frozen[0])

    robot, _ = supervised(Device(freeze, since=800, noise_N=0.05))
    with pytest.raises(GuardTripped, match="wrench_stuck") as trip:
        spin(robot, 900)
    assert trip.value.stamp_s < 8.0 + 0.06


def test_a_loose_contact_ends_patience() -> None:
    """Single blocks that repeat the last sample, three of ten."""

    def loose(seen: Observation) -> Observation:
        lost = round(seen.now_s * 100) % 10 in (0, 3, 6)
        return dataclasses.replace(seen, wrench_S=np.tile(seen.wrench_S[-1], (10, 1))) if lost else seen

    robot, found = supervised(Device(loose, since=800, noise_N=0.05))
    with pytest.raises(GuardTripped, match="wrench_stuck") as trip:
        spin(robot, 1000)
    assert trip.value.stamp_s < 8.3
    assert sum(not f.fatal for f in found) == SupervisionLimits().tolerated


def test_a_clipped_component_is_noticed() -> None:
    def clip(seen: Observation) -> Observation:
        wrench = seen.wrench_S.copy()
        wrench[:, 2] = np.minimum(wrench[:, 2] + 9.0, 1.0)
        return dataclasses.replace(seen, wrench_S=wrench)

    robot, _ = supervised(Device(clip, since=800, noise_N=0.05))
    with pytest.raises(GuardTripped, match="Fz stand still"):
        spin(robot, 900)


@pytest.mark.parametrize(("noise_N", "noted"), [(0.15, False), (1.0, True)])
def test_a_drowned_force_is_put_on_record_only(noise_N: float, noted: bool) -> None:
    robot, found = supervised(Device(noise_N=noise_N))
    spin(robot, 1000)
    assert {f.guard for f in found} == ({"wrench_noise"} if noted else set())
    assert not any(f.fatal for f in found)
    assert len(found) < 12, "once a second"


@pytest.mark.parametrize("noise_m", [2e-5, 0.0])
def test_maps_that_come_again_and_again(noise_m: float) -> None:
    """Of noisy pads they are frozen; flat ones without noise say nothing."""
    rng = np.random.default_rng(3)
    frames = [noise_m * rng.standard_normal((2, 35, 20)) for _ in range(30)]
    count = [0]

    def pads(seen: Observation) -> Observation:
        count[0] += 1
        left, right = frames[min(count[0], 29)]
        return dataclasses.replace(seen, tactile=TactileFrame(seen.now_s, left, right))

    robot, found = supervised(Device(pads))
    if noise_m == 0.0:
        spin(robot, 100, Command(tactile=True))
        assert found == []
        return
    spin(robot, 29, Command(tactile=True))
    with pytest.raises(GuardTripped, match="tactile_frozen"):
        spin(robot, 4, Command(tactile=True))


def test_a_noise_free_sensor_is_never_stuck() -> None:
    def pressed(seen: Observation) -> Observation:
        """Loads and unloads without noise, as an ideal simulation does; constant in between."""
        wrench = np.zeros((10, 6))
        wrench[:, 2] = 5.0 * np.clip(np.sin(seen.stamp_s), 0.0, 0.9)
        return dataclasses.replace(seen, wrench_S=wrench)

    robot, found = supervised(Device(pressed))
    spin(robot, 3000)
    assert found == []


def test_depth_maps_that_do_not_come_are_missed_only_when_asked_for() -> None:
    device = FakeRobot(frame_rate_Hz=1e-3)
    robot, _ = supervised(device)
    robot.cycle(Command(tactile=True))  # the only frame for a thousand seconds
    spin(robot, 100)
    with pytest.raises(GuardTripped, match="tactile_stale"):
        spin(robot, 25, Command(tactile=True))


@pytest.mark.parametrize(
    ("value", "share", "fatal"), [(np.nan, 0.03, False), (np.nan, 0.6, True), (np.inf, 0.01, True)]
)
def test_dead_taxels_are_borne_dead_pads_are_not(value: float, share: float, fatal: bool) -> None:
    def spoil(seen: Observation) -> Observation:
        left = np.zeros((35, 20))
        left.ravel()[: round(share * left.size)] = value
        return dataclasses.replace(seen, tactile=TactileFrame(seen.now_s, left, np.zeros((35, 20))))

    robot, found = supervised(Device(spoil))
    if not fatal:
        spin(robot, 100, Command(tactile=True))
        assert found == []
        return
    with pytest.raises(GuardTripped, match="tactile_dead"):
        spin(robot, 100, Command(tactile=True))


HOME = np.array(FakeRobot().description.home_q)
BAD_COMMANDS = {
    "a number that is none": setpoint(HOME + np.nan),
    "a joint out of range": setpoint(np.full(7, 2.9)),
    "a jump": setpoint(HOME + 0.5),
    "a velocity": setpoint(HOME, np.full(7, 9.0)),
    "the wrong shape": Command(JointSetpoint(np.zeros(6), np.zeros(6), np.zeros(6), Pose(np.zeros(3)))),
    "the aperture": Command(gripper=GripperTarget(0.2, 0.1, 10.0)),
    "the jaws' speed": Command(gripper=GripperTarget(0.05, float("nan"), 10.0)),
    "the jaws' force": Command(gripper=GripperTarget(0.05, 0.1, 1e4)),
    "a number of the aperture": Command(gripper=GripperTarget(float("inf"), 0.1, 10.0)),
}


@pytest.mark.parametrize("command", BAD_COMMANDS.values(), ids=BAD_COMMANDS.keys())
def test_what_must_not_be_sent_is_not_sent(command: Command) -> None:
    device = Device()
    robot, found = supervised(device)
    robot.cycle(setpoint(HOME))
    with pytest.raises(GuardTripped) as trip:
        robot.cycle(command)
    assert trip.value.guard == "command"
    assert all(c is not command for c in device.commands)
    assert device.holds == 1
    assert found[-1].guard == "command"


def test_a_tool_that_would_be_too_fast_is_not_sent() -> None:
    """Every joint within its speed, together too fast for the tool: P by differences of the forward kinematics."""
    device = Device()
    robot, _ = supervised(device)
    robot.cycle(setpoint(HOME))
    step = 0.02 * np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    speed = np.linalg.norm(
        forward(device.description, HOME + step).position_m - forward(device.description, HOME).position_m
    )
    assert speed / 0.01 > device.limits.tcp_speed_m_s
    with pytest.raises(GuardTripped, match="m/s"):
        robot.cycle(setpoint(HOME + step, step / 0.01))


def test_after_a_hold_a_setpoint_begins_where_the_arm_stands() -> None:
    device = Device()
    robot, found = supervised(device)
    for k in range(5):
        robot.cycle(setpoint(HOME + 0.0002 * k, np.full(7, 0.01)))
    spin(robot, 5)
    robot.cycle(setpoint(device.observe().q[-1] + 0.01))
    assert found == []


@pytest.mark.parametrize(
    ("error", "guard"),
    [
        (BackendError("cable"), "device"),
        (StaleReading("wrench", 1.0, 0.2), "device"),
        (SafetyStop("force_N", 33.0, 30.0, 0.1), "wrench"),
    ],
)
def test_what_the_device_raises_is_on_record_and_raised(error: BackendError, guard: str) -> None:
    class Lost(Device):
        def cycle(self, command: Command) -> Observation:
            raise error

    device = Lost()
    robot, found = supervised(device)
    with pytest.raises(type(error)) as raised:
        robot.cycle(HOLD)
    assert raised.value is error
    assert [f.guard for f in found] == [guard]
    assert device.holds >= 1
    with pytest.raises(type(error)):
        robot.cycle(HOLD)


@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1), noise=st.floats(0.0, 0.25))
def test_what_is_in_order_passes_untouched(seed: int, noise: float) -> None:
    """Random walks within half of the limits, with noise: the very same blocks come out, and nothing is found."""
    rng = np.random.default_rng(seed)
    device = Device(noise_N=noise)
    robot, found = supervised(device)
    q = HOME.copy()
    speed = np.zeros(7)
    for k in range(300):
        speed = np.clip(speed + 0.02 * rng.standard_normal(7), -0.05, 0.05)
        q = q + 0.01 * speed
        jaws = GripperTarget(float(rng.uniform(0, 0.085)), 0.1, 10.0) if k % 40 == 0 else None
        command = HOLD if k % 50 > 40 else dataclasses.replace(setpoint(q, speed), gripper=jaws, tactile=k % 2 == 0)
        if k % 50 > 40:
            speed[:] = 0.0
        before = device.cycles
        seen = robot.cycle(command)
        assert device.cycles == before + 1
        assert len(seen.stamp_s) == 10
    assert found == []


def test_it_is_a_robot_like_the_one_it_watches() -> None:
    device = Device()
    robot, _ = supervised(device)
    assert (robot.description, robot.limits, robot.period_s) == (device.description, device.limits, device.period_s)
    assert robot.inner is device
    assert robot.snapshot() is None
    with robot:
        assert robot.observe() is device.observe()
    assert device.holds == 1


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_limits_are_checked_at_birth(value: float) -> None:
    with pytest.raises(ParamError, match="following_rad"):
        SupervisionLimits(following_rad=value)
