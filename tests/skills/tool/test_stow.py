"""stow on the fake robot: whatever is in the hand."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_bt.robot import Pose
from glotouch_skills.tool.stow import Stow

STOWED = np.array([0.45, -0.32, -0.06])


@pytest.fixture
def make(bench, tool):
    def make_one(grip_width_m: float | None = 0.016, probe: bool = True, lighter_N: float = 0.0):
        b = bench(grip_width_m=grip_width_m, weight_N=lambda position, aperture: -lighter_N)
        goal = tool.pose_B_P(b.world, np.array([0.02, 0.05, 0.03]))
        if not probe:
            goal = Pose(np.array([0.62, 0.05, -0.16]), goal.quat)
        b.go(b.arm.joints(b.arm.kinematics.ik(goal, b.arm.q)))
        b.go(b.arm.jaws(0.0, speed_m_s=0.2))
        b.arm.scene.hold_tool(probe)
        return b, b.make(Stow)

    return make_one


def test_a_held_probe_goes_back(make) -> None:
    b, skill = make()
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert not b.arm.scene.holding_tool
    np.testing.assert_allclose(b.arm.pose_B_P.position_m, STOWED + np.array([0, 0, 0.08]), atol=1e-4)
    assert b.arm.aperture_m == pytest.approx(0.046, abs=1e-4)


def test_it_rises_before_it_goes_anywhere(make) -> None:
    b, skill = make()
    here, begun = b.arm.pose_B_P.position_m, len(b.commands)
    b.run(skill)
    for c in b.commands[begun:]:
        if c.motion is None:
            continue
        at = c.motion.pose_B_P.position_m
        ball_m = at[2] + 0.2 - 0.136
        assert ball_m > 0.12 or np.linalg.norm(at[:2] - here[:2]) < 2e-3 or np.linalg.norm(at[:2] - STOWED[:2]) < 2e-3


def test_what_weighs_is_held_whatever_the_jaws_report(make) -> None:
    b, skill = make(grip_width_m=0.025)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    np.testing.assert_allclose(b.arm.pose_B_P.position_m, STOWED + np.array([0, 0, 0.08]), atol=1e-4)


def test_stow__motion_refused__a_caught_hand_does_not_pull(bench, tool) -> None:
    """Something holds it from 20 mm above where it begins, with 3 N/mm."""
    tie_m: list[float] = []
    b = bench(grip_width_m=0.016, weight_N=lambda p, aperture: 3000.0 * max(p[2] - tie_m[0], 0.0) if tie_m else 0.0)
    b.go(b.arm.joints(b.arm.kinematics.ik(tool.pose_B_P(b.world, np.array([0.02, 0.05, 0.03])), b.arm.q)))
    b.arm.scene.hold_tool(True)
    tie_m.append(b.arm.pose_B_P.position_m[2] + 0.02)
    skill = b.make(Stow)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "motion_refused")
    assert "N more than at rest" in skill.reason.message
    assert 0.0 < b.arm.pose_B_P.position_m[2] - tie_m[0] < 0.01


def test_a_lost_probe(make) -> None:
    b, skill = make(grip_width_m=None, lighter_N=0.59)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert not b.arm.scene.holding_tool
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.13


def test_stow__object_held__an_object_is_kept(make) -> None:
    b, skill = make(grip_width_m=0.04, probe=False)
    begun = len(b.commands)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "object_held")
    assert all(c.gripper is None for c in b.commands[begun:])
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


def test_an_empty_hand_rises(make) -> None:
    b, skill = make(grip_width_m=None, probe=False)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert float(b.arm.pose_B_P.position_m[2]) > -0.2 + 0.14


def test_broken_off_anywhere(make, preempt_all_along) -> None:
    preempt_all_along(make, 5)
