"""When faults begin and end, what is counted, and that nothing happens when nothing shall."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from glotouch_bt.faults import FaultInjector
from glotouch_bt.faults.plan import FaultPlan
from glotouch_bt.robot import (
    HOLD,
    BackendError,
    BadInput,
    Command,
    GripperTarget,
    JointSetpoint,
    Observation,
    ParamError,
)
from glotouch_bt.robot.fake import FakeRobot
from tests.faults.conftest import Pair, plan_of, wave

Make = Callable[..., Pair]


def altered(made: Pair, cycles: int) -> list[int]:
    """The periods in which something was altered, counted from 0."""
    found = []
    for i, (true, got) in enumerate(made.cycles(cycles)):
        if not np.array_equal(true.wrench_S, got.wrench_S):
            found.append(i)
    return found


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("when: {cycle: 7}, for: {cycles: 3}", [7, 8, 9]),
        ("when: {time_s: 50 ms}, for: 0.02 s", [5, 6]),
        ("for: {cycles: 2}, repeat: {times: 3, every_s: 0.1}", [0, 1, 10, 11, 20, 21]),
        ("when: {call: 12}, for: {cycles: 1}", [12]),
        ("for: ever", list(range(30))),
    ],
)
def test_moments(pair: Make, text: str, expected: list[int]) -> None:
    assert altered(pair(f"  - {{fault: wrench_off, {text}}}"), 30) == expected


def test_a_condition_on_what_the_device_senses(pair: Make) -> None:
    made = pair("  - {fault: wrench_off, when: {force_above_N: 2.9}, for: {cycles: 1}, repeat: {times: 1000}}")
    forces = []
    for true, got in made.cycles(100):
        forces.append((float(np.linalg.norm(true.wrench_S[-1, :3])), not got.wrench_S.any()))
    for (before, _), (_, off) in pairwise(forces):
        assert off == (before > 2.9)


def test_a_node_and_its_visits(pair: Make) -> None:
    made = pair("  - {fault: wrench_off, when: {node: sweep, visit: 2, after_s: 0.02}, for: node}")
    assert altered(made, 3) == []
    made.injector.on_node_started("m/seq/sweep", 0.03)
    assert altered(made, 3) == []
    made.injector.on_node_ended("m/seq/sweep")
    made.injector.on_node_started("m/seq/sweep", 0.06)
    assert altered(made, 5) == [2, 3, 4]
    made.injector.on_node_ended("m/seq/sweep")
    assert altered(made, 3) == []
    assert made.proof.nodes == ["m/seq/sweep"]


def test_without_a_fault_under_way_the_very_same_block_passes() -> None:
    device = FakeRobot(wrench=wave)
    injector = FaultInjector(device, FaultPlan("none", ()), 0)
    assert all(injector.cycle(HOLD) is device.observe() for _ in range(5))
    assert injector.observe() is device.observe()


def test_a_fault_that_altered_nothing_says_so(pair: Make) -> None:
    made = pair("  - {fault: wrench_scale, with: {factor: 1.0}}")
    made.wrenches(10)
    (report,) = made.injector.report()
    assert report["applied"] == 1
    assert report["samples_altered"] == 0
    assert report["effective"] is False


def test_two_faults_do_not_change_each_others_draws() -> None:
    noise = "  - {fault: wrench_noise}"
    alone, both = Pair(noise), Pair(noise + "\n  - {fault: wrench_intermittent, when: {cycle: 1000}}")
    assert np.array_equal(alone.wrenches(20)[1], both.wrenches(20)[1])


def test_the_later_fault_has_the_last_word() -> None:
    made = Pair("  - {fault: wrench_off}\n  - {fault: wrench_bias, with: {force_N: [1, 0, 0]}}")
    _, got = made.wrenches(3)
    assert (got == [1, 0, 0, 0, 0, 0]).all()


def test_who_saw_it_and_how_soon(pair: Make) -> None:
    made = pair("  - {fault: wrench_off, when: {cycle: 10}}")
    made.injector.add_sighting(0.05, "early", "before", "the fault")
    made.wrenches(20)
    made.injector.add_sighting(0.15, "squeeze", "off_zero", "the wrist reads nothing")
    made.injector.on_node_started("m/tare", 0.16)
    made.injector.conclude("failure", "off_zero", "...", 0.3)
    (report,) = made.injector.report()
    assert report["first_s"] == pytest.approx(0.11)  # the newest sample of the first altered block
    assert report["seen"]["by"] == "squeeze"
    assert report["latency_s"] == pytest.approx(0.04)
    assert report["recovery"] == ["tare"]
    assert report["outcome"] == "failure"


@pytest.mark.parametrize(("fault", "error"), [("robot_fault", BackendError), ("exception", RuntimeError)])
def test_every_call_of_the_seam_can_fail(fault: str, error: type[Exception]) -> None:
    for n in range(4):
        injector = FaultInjector(FakeRobot(), plan_of(f"  - {{fault: {fault}, when: {{call: {n}}}}}"), 0)
        calls = [injector.observe, lambda i=injector: i.cycle(HOLD), lambda i=injector: i.cycle(HOLD), injector.observe]
        for k, call in enumerate(calls):
            if k < n:
                call()
            else:
                with pytest.raises(error, match="injected"):
                    call()
        assert injector.proofs()[0].changes == 4 - n
        assert injector.sightings[0].by == "device"
        injector.hold()
        assert injector.held


def setpoint(q: np.ndarray) -> Command:
    from glotouch_bt.robot.fake import FAKE_ARM, forward

    return Command(JointSetpoint(q, np.zeros(7), np.zeros(7), forward(FAKE_ARM, q)))


def test_a_following_error_is_a_motion_without_jumps(pair: Make) -> None:
    """Position and velocity of every setpoint agree, also after a hold in which the arm braked by itself."""
    made = pair("  - {fault: following_error, with: {joint: 2, offset_rad: -0.05, rise_s: 0.2}}")
    q, period_s = np.array(made.device.description.home_q), made.device.period_s
    sent: list[tuple[float, float]] = []
    cycle = made.device.cycle

    def spy(command: Command) -> Observation:
        if command.motion is not None:
            sent.append((command.motion.q[2] - q[2], command.motion.dq[2]))
        return cycle(command)

    made.device.cycle = spy  # type: ignore[method-assign]
    for i in range(60):
        made.injector.cycle(HOLD if i in (6, 7, 8) else setpoint(q))
    x, v = np.array(sent).T
    for stretch in (slice(0, 6), slice(6, None)):
        mean = 0.5 * (v[stretch][1:] + v[stretch][:-1])
        jumps = np.abs(np.diff(x[stretch]) - mean * period_s)
        assert jumps.max() <= 0.125 * period_s + 1e-9  # in the last period it ends exactly at its deviation
        assert np.count_nonzero(jumps > 1e-5) <= 1
    assert abs(x[6] - x[5]) < 0.25 * period_s
    assert x[-1] == pytest.approx(-0.05)
    assert np.abs(v).max() == pytest.approx(0.25)


def test_arm_faults(pair: Make) -> None:
    made = pair("  - {fault: following_error, with: {joint: 2, offset_rad: 0.01, rise_s: 0.02}}")
    q = np.array(made.device.description.home_q)
    for _ in range(3):
        made.injector.cycle(setpoint(q))
    assert np.allclose(made.device.observe().q[-1] - q, [0, 0, 0.01, 0, 0, 0, 0])
    made = pair("  - {fault: joint_limit, with: {margin_rad: 0.05}}")
    made.injector.cycle(setpoint(q + 0.04))
    with pytest.raises(ParamError, match="injected joint limit"):
        made.injector.cycle(setpoint(q + 0.06))
    made = pair("  - {fault: slow_cycle, with: {periods: 4, share: 1.0}}")
    made.injector.cycle(HOLD)
    assert made.device.cycles == 5
    made = pair("  - {fault: stale_data, when: {cycle: 1}}")
    first = made.injector.cycle(HOLD)
    assert made.injector.cycle(HOLD) is first
    assert made.device.cycles == 2
    made = pair("  - {fault: lost_cycle, with: {lost: 1.0}}")
    made.injector.cycle(setpoint(q + 0.01))
    assert made.device.commands == [HOLD]


def test_gripper_faults(pair: Make) -> None:
    close = Command(gripper=GripperTarget(0.0, 0.35, 10.0))
    made = pair("  - {fault: grip_short, with: {short_m: 5 mm}}")
    for _ in range(60):
        made.injector.cycle(close)
    assert made.device.observe().gripper.aperture_m == pytest.approx(0.005)
    made = pair("  - {fault: grip_stall, for: {cycles: 60}}")
    for _ in range(50):
        made.injector.cycle(close)
    assert made.device.observe().gripper.aperture_m == pytest.approx(0.085)
    made = pair("  - {fault: grip_slip, with: {factor: 0.2}}", grip_width_m=0.02)
    for _ in range(60):
        seen = made.injector.cycle(close)
    assert made.device.observe().gripper.force_N == pytest.approx(2.0)
    assert seen.gripper.force_N == pytest.approx(10.0)
    made = pair("  - {fault: grip_drop, when: {cycle: 60}, with: {opening_m: 10 mm, masked: true}, for: 1 s}")
    told, real = [], []
    for i in range(160):
        told.append(made.injector.cycle(close if i == 0 else HOLD).gripper.aperture_m)
        real.append(made.device.observe().gripper.aperture_m)
    assert max(told[60:]) == pytest.approx(0.0)
    assert max(real[60:]) == pytest.approx(0.010)
    assert real[-1] == pytest.approx(0.0)


def test_touch_faults(pair: Make) -> None:
    ask = Command(tactile=True)
    frames = {}
    for text in (
        "touch_dead, with: {share: 0.25}",
        "touch_dropped",
        "touch_swapped",
        "gel_offset, with: {left_m: 0.2 mm, right_m: -0.1 mm}",
        "touch_frozen",
    ):
        made = pair(f"  - {{fault: {text}}}")
        frames[text.split(",")[0]] = [f for _, o in made.cycles(40, ask) if (f := o.tactile) is not None]
    assert not frames["touch_dropped"]
    dead = frames["touch_dead"]
    assert all(np.array_equal(np.isnan(f.left_m), np.isnan(dead[0].left_m)) for f in dead)
    assert abs(np.isnan(dead[0].left_m).mean() - 0.25) < 0.08
    assert all((f.left_m == 2e-4).all() and (f.right_m == -1e-4).all() for f in frames["gel_offset"])
    stamps = [f.stamp_s for f in frames["touch_frozen"]]
    assert stamps == sorted(set(stamps))
    assert all(f.left_m is frames["touch_frozen"][0].left_m for f in frames["touch_frozen"])


def test_what_cannot_be_done_here_is_said_before_anything_moves() -> None:
    for fault in ("object_shoved", "kill"):
        with pytest.raises(BadInput, match=r"plan\.yaml:3:5: " + fault):
            FaultInjector(FakeRobot(), plan_of(f"  - fault: {fault}"), 0)
