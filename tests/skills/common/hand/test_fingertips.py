"""A fingertip that came down on something does not come down there again."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.motion import hand_pose_B
from glotouch_bt.robot import MotionRefused, Pose
from glotouch_skills.common.hand.fingertips import fingertip_places, force_offset_m
from glotouch_skills.common.hand.hand import require_clear

OPENING = 0.06


def observed(wrench_E: np.ndarray) -> SimpleNamespace:
    """An observation of which only the wrench is read: (10, 6) in S = E."""
    return SimpleNamespace(wrench_S=np.tile(wrench_E, (10, 1)))


@pytest.mark.parametrize("y", [-0.045, 0.0, 0.03])
def test_a_force_acts_where_its_moment_says(y: float) -> None:
    """Closed form: a force at (0, y, -16 mm) in P, seen in a wrist frame that is turned and shifted."""
    turn = np.array([np.cos(0.4), 0.0, 0.0, np.sin(0.4)])
    pose_E_P = Pose(np.array([0.01, -0.02, 0.17]), turn)
    force_E = pose_E_P.rotation @ np.array([0.0, 0.0, -3.0])
    arm_E = pose_E_P.apply(np.array([0.0, y, -0.016]))
    weight = np.array([0.4, -0.2, 9.0, 0.1, 0.05, -0.02])
    pressed = weight + np.concatenate([force_E, np.cross(arm_E, force_E)])
    assert force_offset_m([observed(pressed)], [observed(weight)], pose_E_P) == pytest.approx(y, abs=1e-9)


def test_fingertips_stand_on_both_sides_of_the_opening(bench) -> None:
    b = bench()
    pose = hand_pose_B(b.arm, b.world.container, np.array([0.02, 0.01, 0.03]), 0.0)
    right, left = fingertip_places(b.arm, pose, OPENING)
    deep = 2.0 * b.arm.description.gripper.finger.half_m[1]
    np.testing.assert_allclose([right.mean(axis=0)[0], left.mean(axis=0)[0]], 0.02, atol=1e-9)
    gap = abs(float(left[:, 1].mean() - right[:, 1].mean()))
    assert gap == pytest.approx(OPENING + deep)


def test_a_stance_is_refused_where_a_fingertip_met_something_higher(bench) -> None:
    b = bench()
    tips = b.arm.description.gripper.fingertip_below_P_m

    def pose(x: float, tips_m: float) -> Pose:
        return hand_pose_B(b.arm, b.world.container, np.array([x, 0.0, tips_m + tips]), 0.0)

    require_clear(b.arm, pose(0.0, 0.01), OPENING)
    b.arm.felt.add_met(fingertip_places(b.arm, pose(0.0, 0.05), OPENING)[1], 0.05)
    for x in (0.0, 0.006):
        with pytest.raises(MotionRefused, match="came down on something there, 50 mm up"):
            require_clear(b.arm, pose(x, 0.01), OPENING)
    require_clear(b.arm, pose(0.0, 0.06), OPENING)
    require_clear(b.arm, pose(0.03, 0.01), OPENING)
    b.arm.felt.forget_near(np.array([0.0, 0.0]))
    require_clear(b.arm, pose(0.0, 0.01), OPENING)
