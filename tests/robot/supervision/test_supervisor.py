"""Each guard trips within one period on its own fault, and no guard trips on anything else."""

from __future__ import annotations

import dataclasses
from pathlib import Path
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
)
from glotouch_bt.robot.fake import FakeRobot, forward
from glotouch_bt.robot.supervision.limits import SupervisionLimits
from glotouch_bt.robot.supervision.supervisor import MAX_RECORDED
from glotouch_bt.robot.supervision.targets import distance_to_path
from tests.robot.supervision.supervised import (
    Device,
    Spoil,
    all_of,
    jaws,
    setpoint,
    spin,
    stamps,
    supervised,
    with_part,
)
from tests.support.examples import examples

GUARDS_PAGE = Path(__file__).parents[3] / "docs/explanation/supervision.md"

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
def test_each_guard_holds_the_arm_within_one_period_and_is_recorded(guard: str, spoil: Spoil) -> None:
    device = Device(spoil, since=20)
    robot, found = supervised(device)
    if guard == "following":
        robot.cycle(setpoint(device.description.home_q))
    with pytest.raises(GuardTripped) as trip:
        spin(robot, 30)
    assert trip.value.guard == guard
    assert device.cycles <= 21 + (6 if "finite" in guard else 0), "not in the faulty period"
    assert device.holds == 1
    assert found[-1].guard == guard
    assert found[-1].fatal
    assert f"`{guard}`" in GUARDS_PAGE.read_text(), "the page lists every guard"
    assert np.isnan(trip.value.value) or trip.value.value != trip.value.limit
    assert str(trip.value.stamp_s)[:4] in str(trip.value) or trip.value.stamp_s > 0
    # every later cycle holds and raises the same error
    commands = len(device.commands)
    with pytest.raises(GuardTripped) as again:
        robot.cycle(setpoint(np.zeros(7)))
    assert again.value is trip.value
    assert device.commands[commands:] == [HOLD]


@pytest.mark.parametrize("part", ["q", "dq", "wrench_S", "position_B_P", "quat_B_P"])
def test_single_samples_that_are_not_finite_are_dropped(part: str) -> None:
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


def test_too_many_transient_findings_are_fatal() -> None:
    robot, found = supervised(Device(with_part("wrench_S", 0, 0, np.nan), since=5))
    with pytest.raises(GuardTripped) as trip:
        spin(robot, 50)
    assert trip.value.guard == "not_finite"
    assert sum(not f.fatal for f in found) == SupervisionLimits().tolerated


def test_rare_findings_are_tolerated_and_only_the_first_are_recorded() -> None:
    class Rare(Device):
        def cycle(self, command: Command) -> Observation:
            self._since = self._until = -1
            if self.cycles % 50 == 7:
                self._since, self._until = 0, 10**9
            return super().cycle(command)

    robot, found = supervised(Rare(with_part("dq", 9, 2, np.nan)))
    for _ in range(50 * (MAX_RECORDED + 10)):
        robot.cycle(HOLD)
    assert robot.counts == {"not_finite": MAX_RECORDED + 10}
    assert len(found) == MAX_RECORDED


def test_following__an_arm_that_drifts_during_a_hold() -> None:
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


@pytest.mark.parametrize("force_N", [0.0, 7.0, 9.0, -20.0])
def test_following__smaller_limit_while_the_arm_presses(force_N: float) -> None:
    """Above the pressing force, half the following error trips the guard."""

    def displaced(seen: Observation) -> Observation:
        away = [[0.002, 0.0, 0.0]] * np.maximum(seen.stamp_s[:, None] - 0.2, 0.0)
        wrench = seen.wrench_S + force_N * np.eye(6)[0]
        return dataclasses.replace(seen, position_B_P=seen.position_B_P + away, wrench_S=wrench)

    device = Device(displaced)
    robot, found = supervised(device)
    robot.cycle(setpoint(device.description.home_q))
    with pytest.raises(GuardTripped) as trip:
        spin(robot, 1000)
    rules = SupervisionLimits()
    touches = abs(force_N) > rules.touching_N
    limit = rules.touching_m if touches else rules.following_m
    assert trip.value.guard == "following"
    assert limit < trip.value.value < limit * 1.02
    assert ("presses with" in found[-1].what) is touches


def test_following__servo_compliance_is_allowed() -> None:
    """0.15 mm/N, the largest compliance of the simulated servo, up to 12 N."""

    def gives(seen: Observation) -> Observation:
        force = np.minimum(10.0 * np.maximum(seen.stamp_s - 0.2, 0.0), 12.0)
        wrench = seen.wrench_S.copy()
        wrench[:, 1] = force
        position = seen.position_B_P.copy()
        position[:, 1] += 1.5e-4 * force
        return dataclasses.replace(seen, position_B_P=position, wrench_S=wrench)

    device = Device(gives)
    robot, found = supervised(device)
    robot.cycle(setpoint(device.description.home_q))
    spin(robot, 200)
    assert not [f for f in found if f.fatal]


def test_following__servo_lag_is_allowed() -> None:
    """A delay of 50 ms at half of a joint's speed is not a following error."""
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


HOME = np.array(FakeRobot().description.home_q)
BAD_COMMANDS = {
    "not finite": setpoint(HOME + np.nan),
    "a joint out of range": setpoint(np.full(7, 2.9)),
    "a jump": setpoint(HOME + 0.5),
    "a velocity": setpoint(HOME, np.full(7, 9.0)),
    "the wrong shape": Command(JointSetpoint(np.zeros(6), np.zeros(6), np.zeros(6), Pose(np.zeros(3)))),
    "the aperture": Command(gripper=GripperTarget(0.2, 0.1, 10.0)),
    "the jaws' speed": Command(gripper=GripperTarget(0.05, float("nan"), 10.0)),
    "the jaws' force": Command(gripper=GripperTarget(0.05, 0.1, 1e4)),
    "an infinite aperture": Command(gripper=GripperTarget(float("inf"), 0.1, 10.0)),
}


@pytest.mark.parametrize("command", BAD_COMMANDS.values(), ids=BAD_COMMANDS.keys())
def test_command__is_not_sent(command: Command) -> None:
    device = Device()
    robot, found = supervised(device)
    robot.cycle(setpoint(HOME))
    with pytest.raises(GuardTripped) as trip:
        robot.cycle(command)
    assert trip.value.guard == "command"
    assert all(c is not command for c in device.commands)
    assert device.holds == 1
    assert found[-1].guard == "command"


def test_command__tool_speed() -> None:
    """Every joint keeps its speed limit, but together they move the tool too fast (finite differences)."""
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


def test_command__after_a_hold_a_setpoint_starts_where_the_arm_stands() -> None:
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
def test_device__errors_are_recorded_and_raised(error: BackendError, guard: str) -> None:
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


@settings(max_examples=examples(4, 10), deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1), noise=st.floats(0.0, 0.25))
def test_valid_readings_and_commands_pass_without_a_finding(seed: int, noise: float) -> None:
    """Random walks within half of the limits, with noise."""
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


def test_the_supervisor_has_the_properties_of_its_robot() -> None:
    device = Device()
    robot, _ = supervised(device)
    assert (robot.description, robot.limits, robot.period_s) == (device.description, device.limits, device.period_s)
    assert robot.snapshot() is None
    with robot:
        assert robot.observe() is device.observe()
    assert device.holds == 1


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_limits_are_validated(value: float) -> None:
    with pytest.raises(ParamError, match="following_rad"):
        SupervisionLimits(following_rad=value)


def test_a_guard_of_a_skill_holds_the_arm_and_is_recorded_once() -> None:
    robot, found = supervised(Device())
    error = GuardTripped("following", "off", 4e-3, 3e-3, 0.2)
    robot.trip_by(error)
    robot.trip_by(error)
    assert [(f.guard, f.what, f.value, f.limit, f.stamp_s, f.fatal) for f in found] == [
        ("following", "off", 4e-3, 3e-3, 0.2, True)
    ]
    assert robot.counts == {"following": 1}
    with pytest.raises(GuardTripped) as again:
        robot.cycle(HOLD)
    assert again.value is error


def test_a_guard_of_the_supervisor_is_not_recorded_again() -> None:
    robot, found = supervised(Device(with_part("q", slice(None), slice(None), np.nan), since=5))
    with pytest.raises(GuardTripped) as trip:
        spin(robot, 30)
    count = len(found)
    robot.trip_by(trip.value)
    assert len(found) == count


def test_following__a_hand_that_leaves_its_path_fast_is_stopped_before_the_limit() -> None:
    """0.2 m/s: a tenth of a second of motion would be 20 mm."""

    def leaves(seen: Observation) -> Observation:
        away = [[0.2, 0.0, 0.0]] * np.maximum(seen.stamp_s[:, None] - 0.2, 0.0)
        return dataclasses.replace(seen, position_B_P=seen.position_B_P + away)

    device = Device(leaves)
    robot, found = supervised(device)
    robot.cycle(setpoint(device.description.home_q))
    with pytest.raises(GuardTripped, match="leaves it at 200 mm/s") as trip:
        spin(robot, 100)
    assert trip.value.stamp_s < 0.2 + 0.011
    assert found[-1].guard == "following"


def moving_command(k: int) -> Command:
    """A setpoint on the way at 0.1 m/s along a circle about the base, 1 mm a period."""
    radius_m = float(np.hypot(*forward(FakeRobot().description, HOME).position_m[:2]))
    return setpoint(HOME + 0.001 * k / radius_m * np.eye(7)[0], 0.1 / radius_m * np.eye(7)[0])


@pytest.mark.parametrize(("away_m", "trips"), [(0.015, False), (0.03, True)])
def test_following__an_arm_that_brakes_may_not_go_farther_than_it_must(away_m: float, trips: bool) -> None:
    """v^2 / 2a = 2.5 mm, 10 mm of lag, 6 mm of following error."""

    def runs_away(seen: Observation) -> Observation:
        return dataclasses.replace(
            seen, position_B_P=np.add(seen.position_B_P, (0.0, 0.0, away_m)), dq=seen.dq + 0.2 * np.eye(7)[0]
        )

    device = Device(runs_away, since=6)
    robot, _ = supervised(device)
    for k in range(6):
        robot.cycle(moving_command(k))
    if trips:
        with pytest.raises(GuardTripped, match="told to stop"):
            spin(robot, 1)
    else:
        spin(robot, 20)


def test_distance_to_path__between_its_points() -> None:
    path = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.01, 0.01, 0.0]]
    assert distance_to_path([0.005, 0.001, 0.0], path) == pytest.approx(0.001)
    assert distance_to_path([0.012, 0.004, 0.0], path) == pytest.approx(0.002)
    assert distance_to_path([0.01, 0.02, 0.0], path) == pytest.approx(0.01)
    assert distance_to_path([0.0, 0.0, 0.003], path[:1]) == pytest.approx(0.003)
