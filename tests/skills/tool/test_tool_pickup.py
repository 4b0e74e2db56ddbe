"""tool_pickup on the fake robot: what it reports, every way it fails, and that it can be broken off anywhere."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.robot import Command, GripperTarget, GuardTripped
from glotouch_skills.common.hand.line_guard import MAX_OFF_LINE_M
from glotouch_skills.tool.tool_pickup import MAX_APPROACH_FORCE_N, MAX_PULL_FORCE_N, ToolPickup
from tests.support.outlines import rectangle

STOWED = np.array([0.45, -0.32, -0.06])
WEIGHT_N = 0.060 * 9.81
FLOOR_M = 0.0012


def probe_weight(position_B, aperture: float) -> float:
    """The probe's weight once it is gripped and out of its seat."""
    seated = np.linalg.norm(position_B - STOWED) < 0.002
    return WEIGHT_N if aperture < 0.0161 and not seated else 0.0


@pytest.fixture
def make(bench, things):
    def make_one(grip_width_m=0.016, weight_N=probe_weight, floor_m=FLOOR_M, standing=(), **params):
        b = bench(things=[things.floor(floor_m), *standing], weight_N=weight_N, grip_width_m=grip_width_m)
        return b, b.make(ToolPickup, **params)

    return make_one


def test_the_probe_is_held_and_the_floor_felt(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    tool = skill.tool
    # The floor is felt on an elastic contact: 0.6 N on 3000 N/m is 0.2 mm.
    assert tool.floor_z_K_m == pytest.approx(FLOOR_M, abs=3e-4)
    assert tool.aperture_m == pytest.approx(0.016, abs=1e-6)
    assert tool.tip_P_m == pytest.approx([0, 0, b.world.probe.grasp_to_tip_m])
    assert np.cos(tool.yaw_B_rad - b.arm.pose_B_P.yaw_rad) == pytest.approx(1.0, abs=1e-8)
    assert b.arm.scene.holding_tool
    assert not b.arm.scene._allowed
    assert b.robot.peak_force_N < 5.0
    (event,) = b.of_kind("tool")
    assert event["weight_N"] == pytest.approx(WEIGHT_N, rel=1e-6)  # the hold begins as the hand stops


def test_without_the_touch_the_floor_is_where_it_is_said_to_be(make) -> None:
    b, skill = make(floor_touch=False)
    b.run(skill)
    assert (skill.status, skill.tool.floor_z_K_m) == (Status.SUCCESS, 0.0)


@pytest.mark.parametrize("width_m", [None, 0.030], ids=["empty", "something wide"])
def test_tool_pickup__no_probe(make, width_m: float | None) -> None:
    b, skill = make(grip_width_m=width_m)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_probe")
    assert not b.arm.scene.holding_tool
    assert not b.arm.scene._allowed
    assert b.arm.aperture_m > 0.04, "the jaws are open again"


def test_tool_pickup__probe_not_lifted(make) -> None:
    b, skill = make(weight_N=lambda position, aperture: 0.0)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "probe_not_lifted")
    assert b.arm.scene.holding_tool, "the jaws say so: it is not dropped from here, whatever the wrist says"
    assert b.arm.aperture_m == pytest.approx(0.016, abs=1e-3)


def test_tool_pickup__probe_not_lifted__jaws_have_closed(make) -> None:
    b, skill = make(weight_N=lambda position, aperture: 0.0)
    cycle = b.robot.cycle

    def slid_off(command):
        if b.arm.pose_B_P.position_m[2] > STOWED[2] + 0.02 and b.arm.aperture_m < 0.017:
            b.robot.grip_width_m = None
        return cycle(command)

    b.robot.cycle = slid_off
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "probe_not_lifted")
    assert not b.arm.scene.holding_tool


def test_tool_pickup__hard_contact__probe_stuck_in_its_holder(make) -> None:
    """A spring of 3 N/mm holds it: the rise ends before the robot's own limit does."""

    def stuck(position_B, aperture: float) -> float:
        return 3000.0 * max(position_B[2] - STOWED[2], 0.0) if aperture < 0.0161 else 0.0

    b, skill = make(weight_N=stuck)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "hard_contact")
    assert b.arm.scene.holding_tool, "it is still in the jaws"
    assert b.arm.aperture_m < 0.0161
    assert MAX_PULL_FORCE_N < b.robot.peak_force_N < b.robot.limits.hard_force_N
    assert not b.arm.scene._allowed


def test_tool_pickup__hard_contact__obstacle_above_the_handle(make) -> None:
    """A spring of 3 N/mm, 10 mm above the handle's place."""
    top_m = STOWED[2] + 0.010

    def stands(position_B, aperture: float) -> float:
        over = np.linalg.norm(position_B[:2] - STOWED[:2]) < 0.01
        return -3000.0 * max(top_m - position_B[2], 0.0) if over else 0.0

    b, skill = make(weight_N=stands)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "hard_contact")
    assert not b.arm.scene.holding_tool
    assert b.arm.pose_B_P.position_m[2] > STOWED[2] + 0.05
    assert MAX_APPROACH_FORCE_N < b.robot.peak_force_N < 2.0 * MAX_APPROACH_FORCE_N
    assert not b.arm.scene._allowed


def test_an_arm_that_goes_astray_in_the_holder_is_stopped(make) -> None:
    """The hand goes sideways as it rises, a millimetre in ten: it stops within the slot's 4 mm."""
    b, skill = make()
    cycle, far_m = b.robot.cycle, []

    def astray(command):
        seen = cycle(command)
        if not b.arm.scene.holding_tool:
            return seen
        off = 0.1 * np.maximum(seen.position_B_P[:, 2] - STOWED[2], 0.0)
        far_m.append(float(off.max()))
        return dataclasses.replace(seen, position_B_P=seen.position_B_P + off[:, None] * np.eye(3)[1])

    b.robot.cycle = astray
    with pytest.raises(GuardTripped, match="beside its setpoint"):
        b.run(skill)
    assert b.arm.scene.holding_tool
    assert MAX_OFF_LINE_M < max(far_m) < 0.003


def test_wide_jaws_are_not_narrowed_before_they_are_above_the_stand(make) -> None:
    """The last closure may have ended with an object between them."""
    b, skill = make()
    while b.arm.aperture_m < 0.08:
        b.robot.cycle(Command(motion=None, gripper=GripperTarget(0.085, 0.35, 10.0), tactile=False))
        b.arm.sync(b.robot.observe())
    cycle, narrowed_at = b.robot.cycle, []

    def watch(command):
        if command.gripper is not None and command.gripper.aperture_m < 0.08:
            narrowed_at.append(b.arm.pose_B_P.position_m[:2])
        return cycle(command)

    b.robot.cycle = watch
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert np.allclose(narrowed_at[0], STOWED[:2], atol=0.002)


def test_tool_pickup__no_floor(make) -> None:
    b, skill = make(floor_m=-0.02)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_floor")
    assert b.arm.scene.holding_tool
    assert not b.arm.scene._allowed


@pytest.mark.parametrize(
    "top_m", [0.02, 0.06, 0.085, 0.11], ids=["low", "up to the rim", "higher than the box", "much higher"]
)
def test_the_next_corner_is_taken_if_something_stands_in_the_first(make, things, top_m) -> None:
    b, skill = make(standing=[things.post((-0.13, -0.18), 0.03, top_m)])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.tool.corner.tolist() == [1.0, -1.0]
    assert skill.tool.floor_z_K_m == pytest.approx(FLOOR_M, abs=3e-4)
    assert b.robot.peak_force_N < 5.0


def test_tool_pickup__no_floor__something_stands_in_every_corner(make, things) -> None:
    """The tops, 40 mm high, are met slowly, and are not taken for the floor."""
    b, skill = make(standing=[things.post((x, y), 0.03, 0.04) for x in (-0.13, 0.13) for y in (-0.18, 0.18)])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_floor")
    assert "40, 40, 40, 40 mm" in skill.reason.message
    assert b.robot.peak_force_N < 5.0


def test_tool_pickup__motion_refused(make) -> None:
    """A thing in the way up to which the hand would have to go through."""
    b, skill = make()
    K = b.world.container.pose_B_K.inverse().apply(b.world.holder.pose_B_grasp.position_m)
    b.arm.scene.add_obstacle("crate", rectangle(K[:2], (0.2, 0.2)), height_m=0.3)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert "crate" in skill.reason.message
    assert not b.arm.scene._allowed


def test_tool_pickup__request_failed(make, monkeypatch) -> None:
    b, skill = make()

    class Broken:
        done, error = True, "the sensor is silent"

    monkeypatch.setattr(b.robot, "start", lambda request: Broken())
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "request_failed")
    assert "the sensor is silent" in skill.reason.message


def test_broken_off_anywhere_it_keeps_hold_of_the_probe(make, preempt_all_along) -> None:
    """Once the probe is out of its seat no command opens the jaws, neither on breaking off nor on starting again."""

    def watched():
        b, skill = make()
        cycle = b.robot.cycle

        def watch(command):
            if probe_weight(b.arm.pose_B_P.position_m, b.arm.aperture_m) and command.gripper is not None:
                assert command.gripper.aperture_m <= 0.016, "the jaws are opened with the probe in the air"
            return cycle(command)

        b.robot.cycle = watch
        return b, skill

    preempt_all_along(watched, 6)


def test_started_again_in_the_air_it_lets_go_of_nothing(make) -> None:
    b, skill = make()
    while not (b.arm.scene.holding_tool and b.arm.pose_B_P.position_m[2] > STOWED[2] + 0.05):
        b.tick(skill)
    begun = len(b.robot.commands)
    b.preempt(skill)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert all(c.gripper is None for c in b.robot.commands[begun:]), "the jaws are left alone"
    assert skill.tool.floor_z_K_m == pytest.approx(FLOOR_M, abs=3e-4)
    assert skill.tool.aperture_m == pytest.approx(0.016, abs=1e-6)


def test_started_again_after_the_probe_was_lost_it_fetches_it(make) -> None:
    b, skill = make(grip_width_m=0.016)
    b.arm.scene.hold_tool(True)  # believed, but the jaws stand open
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert np.isclose(skill.tool.aperture_m, 0.016)
