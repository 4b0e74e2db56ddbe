"""tool_calibrate on the fake robot: what it finds, every way it fails, and that it can be broken off anywhere."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_skills.common.probe.free_corner import corner_place, corner_walls, corners
from glotouch_skills.tool.tool_calibrate import ToolCalibrate
from tests.support.outlines import rectangle

STIFFNESS_N_M = 20_000.0


def walls(shift_m=(0.0, 0.0), stiffness_N_m=(STIFFNESS_N_M, STIFFNESS_N_M), max_N=np.inf):
    """The two walls of the corner nearest to the holder (-x, -y), `shift_m` from where they should be.

    A wall of stiffness k against a rigid probe is the same to the hand as a rigid wall against a probe that gives 1/k.
    """

    def force(ball, radius):
        out = np.zeros_like(ball)
        for axis, half in enumerate((0.15, 0.20)):
            inside = (-half + shift_m[axis]) - (ball[:, axis] - radius)
            out[:, axis] = np.clip(stiffness_N_m[axis] * inside, 0.0, max_N)
        return out

    return force


@pytest.fixture
def make(bench, tool):
    """A bench whose ball hangs straight, while the tool is believed to be `believed_m` off.

    It was grasped `askew_rad` from the hand's yaw at home.
    """

    def make_one(believed_m=(0.0, 0.0), things=None, askew_rad=0.0, **params):
        b = bench(things=[walls()] if things is None else things)
        b.arm.scene.hold_tool(True)
        believed = dataclasses.replace(tool, tip_P_m=tool.tip_P_m + np.array([*believed_m, 0.0]),
                                       yaw_B_rad=tool.yaw_B_rad + askew_rad)  # fmt: skip
        return b, b.make(ToolCalibrate, inputs={"before": believed}, **params)

    return make_one


def test_the_corner_is_the_one_by_the_holder(world) -> None:
    first = corners(world)[0]
    assert first.tolist() == [-1.0, -1.0]
    assert corner_place(world, first, 0.02) == pytest.approx([-0.13, -0.18])
    assert corner_walls(first) == ("wall -x", "wall -y")


@pytest.mark.parametrize("believed_m", [(0.0, 0.0), (0.0015, -0.0008), (-0.004, 0.003)])
def test_the_ball_is_found(make, believed_m) -> None:
    b, skill = make(believed_m)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    found = skill.tool
    assert found.tip_P_m == pytest.approx([0.0, 0.0, 0.13], abs=6e-5)
    assert found.tip_sd_m < 5e-5
    assert found.corner_K_m == pytest.approx([-0.15, -0.20], abs=1e-4)
    assert np.cos(found.yaw_B_rad - b.arm.pose_B_P.yaw_rad) == pytest.approx(1.0, abs=1e-8), "turned back"
    assert not b.arm.scene._allowed
    assert len(b.of_kind("contact")) == 6
    assert b.robot.peak_force_N < 12.0


def test_the_walls_may_be_elsewhere(make) -> None:
    b, skill = make((0.001, 0.0), [walls((0.002, -0.0015))])
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.tool.tip_P_m == pytest.approx([0.0, 0.0, 0.13], abs=6e-5)
    assert skill.tool.corner_K_m == pytest.approx([-0.148, -0.2015], abs=1e-4)


def test_the_fake_wrist_reports_at_once(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.tool.latency_s == pytest.approx(0.0, abs=6e-3), "the fake's inertia comes a period at a time"


@pytest.mark.parametrize(
    ("gives_m_N", "askew_rad"), [((2e-3, 3e-4), 0.0), ((2e-4, 3e-3), 0.3), ((2e-3, 3e-4), -0.7), ((5e-5, 5e-5), 0.3)]
)
def test_the_compliance_is_measured_along_the_axes_of_the_hand(make, gives_m_N, askew_rad) -> None:
    """The wall x_P points at gives as its spring does, whatever the yaw at which the probe was grasped."""
    b, skill = make(things=[walls(stiffness_N_m=1.0 / np.array(gives_m_N))], askew_rad=askew_rad, turn_deg=45.0)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    x_P_in_K = np.cos(skill.tool.yaw_B_rad)  # the container stands straight in B
    expected = gives_m_N if abs(x_P_in_K) > 0.7 else gives_m_N[::-1]
    assert skill.tool.compliance_P_m_N == pytest.approx(expected, rel=0.02, abs=5e-6)
    assert b.of_kind("calibration")[-1]["compliance_P_m_N"] == pytest.approx(expected, rel=0.02, abs=5e-6)
    assert b.robot.peak_force_N < 12.0


def test_the_compliance_is_left_unmeasured(make) -> None:
    b, skill = make(press_N=0.0)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.tool.compliance_P_m_N is None
    assert b.of_kind("calibration")[-1]["compliance_P_m_N"] is None


def test_a_ball_that_gives_way_has_slipped(make) -> None:
    b, skill = make(things=[walls(max_N=0.4)])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "slipped")
    assert "gave way" in skill.feedback_message


def test_tool_calibrate__no_wall(make) -> None:
    b, skill = make(things=[])
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "no_wall")
    assert not b.arm.scene._allowed


def test_tool_calibrate__slipped(make) -> None:
    """The probe shifts in the jaws between the touches: here the walls move instead."""
    touched = []

    def moving(ball, radius):
        shift = (0.0, 0.0) if len(touched) < 3 else (-0.0025, -0.0025)
        return walls(shift)(ball, radius)

    b, skill = make(things=[moving])
    record = b.event
    b.event = lambda kind, stamp, data: (touched.append(1) if kind == "contact" else None, record(kind, stamp, data))
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "slipped")


def test_tool_calibrate__motion_refused(make) -> None:
    b, skill = make()
    b.arm.scene.add_obstacle("crate", rectangle((-0.13, -0.18), (0.06, 0.06)), height_m=0.3)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert not b.arm.scene._allowed


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(lambda: make((0.001, 0.0)), 4)
