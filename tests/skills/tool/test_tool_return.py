"""tool_return on the fake robot."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.tool.tool_return import ToolReturn
from tests.support.outlines import rectangle

STOWED = np.array([0.45, -0.32, -0.06])


@pytest.fixture
def make(bench, tool):
    def make_one():
        b = bench(grip_width_m=0.016)
        b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, np.array([0.02, 0.05, 0.14])), b.arm.q)))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        b.arm.scene.hold_tool(True)
        begun = len(b.robot.commands)
        cycle = b.robot.cycle

        def watch(command):
            if command.gripper is not None and command.gripper.aperture_m > 0.016:
                away = np.linalg.norm(b.arm.pose_B_P.position_m - STOWED)
                assert away < 1e-3 or b.arm.aperture_m > 0.04, "the jaws open away from the holder"
            return cycle(command)

        b.robot.cycle = watch
        b.begun = begun
        return b, b.make(ToolReturn, inputs={"tool": tool})

    return make_one


def test_the_probe_is_put_back(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert not b.arm.scene.holding_tool
    assert "probe" in b.arm.scene.obstacles
    assert b.arm.aperture_m == pytest.approx(0.046, abs=1e-4)
    np.testing.assert_allclose(b.arm.pose_B_P.position_m, STOWED + np.array([0, 0, 0.08]), atol=1e-4)
    opened = [c for c in b.robot.commands[b.begun :] if c.gripper is not None]
    assert len(opened) == 1


def test_a_tool_that_slid_in_the_jaws_is_put_where_it_stood(make) -> None:
    b, skill = make()
    slid_B_m = np.array([4e-4, -2e-4])
    b.arm.tool_seat.measured(np.zeros(2))
    b.arm.tool_seat.measured(slid_B_m)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    np.testing.assert_allclose(b.arm.pose_B_P.position_m[:2], STOWED[:2] - slid_B_m, atol=1e-4)
    np.testing.assert_array_equal(b.arm.tool_seat.displacement_B_m, np.zeros(3))


def test_tool_return__motion_refused(make) -> None:
    b, skill = make()
    # A bar between the container and the holder, as high as the hand.
    b.arm.scene.add_obstacle("bar", rectangle((-0.1, -0.2), (0.6, 0.02)), height_m=0.5)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert b.arm.scene.holding_tool


def test_tool_return__request_failed(make, monkeypatch) -> None:
    b, skill = make()

    class Broken:
        done, error = True, "no answer"

    monkeypatch.setattr(b.robot, "start", lambda request: Broken())
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "request_failed")


def test_broken_off_anywhere_it_lets_go_in_the_holder_only(make, preempt_all_along) -> None:
    preempt_all_along(make, 6)


@pytest.mark.parametrize("above_m", [0.12, 0.05, 0.01])
def test_tool_return__tool_lost__dropped_on_the_way_in(make, above_m: float) -> None:
    """The jaws close on nothing: the hand goes no farther down, rises, and the scene says that it is empty."""
    b, skill = make()
    cycle, lowest = b.robot.cycle, [np.inf]

    def drop(command):
        z = b.arm.pose_B_P.position_m[2]
        if z < STOWED[2] + above_m and np.hypot(*(b.arm.pose_B_P.position_m[:2] - STOWED[:2])) < 1e-3:
            seen = cycle(command)
            lowest[0] = min(lowest[0], z)
            return dataclasses.replace(seen, gripper=dataclasses.replace(seen.gripper, aperture_m=0.0, force_N=0.0))
        return cycle(command)

    b.robot.cycle = drop
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "tool_lost")
    assert lowest[0] > STOWED[2] + above_m - 0.005
    assert b.arm.pose_B_P.position_m[2] > STOWED[2] + above_m + 0.07
    assert not b.arm.scene.holding_tool
    assert not [c for c in b.robot.commands[b.begun :] if c.gripper is not None], "the jaws are left as they are"


@pytest.mark.parametrize("above_m", [0.12, 0.05])
def test_tool_return__motion_refused__a_blocked_probe_is_lifted_off(make, above_m: float) -> None:
    """A probe that hangs askew meets the holder's top: the hand stops, rises with it, and says so."""
    b, skill = make()
    cycle, lowest = b.robot.cycle, [np.inf]

    def block(command):
        seen = cycle(command)
        way = b.arm.pose_B_P.position_m - STOWED
        if np.hypot(*way[:2]) > 1e-3:
            return seen
        lowest[0] = min(lowest[0], way[2])
        wrench = seen.wrench_S.copy()
        wrench[:, 2] -= 37e3 * max(above_m - way[2], 0.0)
        return dataclasses.replace(seen, wrench_S=wrench)

    b.robot.cycle = block
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert 37e3 * (above_m - lowest[0]) < 30.0, "it stops in time"
    assert b.arm.pose_B_P.position_m[2] > STOWED[2] + above_m + 0.07
    assert b.arm.scene.holding_tool
    assert not [c for c in b.robot.commands[b.begun :] if c.gripper is not None], "the jaws are left as they are"
