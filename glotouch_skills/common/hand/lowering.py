"""Lower a held object to a place, and wait for jaws that are still closing."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Arm, JawRestDetector, Motion
from glotouch_bt.robot import Pose
from glotouch_bt.skill import Context
from glotouch_skills.common.hand.hand import glide

SLOW_FROM_M = 0.03
"""Height above its place from which the object is lowered slowly."""
JAW_REST_S = 1.5
"""Longest wait for jaws that lost their object to stop closing."""
RELEASE_HEIGHT_M = 0.0015
"""Release the object at this height above its place: a stiff arm would press it hard on the floor."""


def lower(context: Context, place_B_P: Pose, approach_m_s: float, lower_m_s: float) -> Motion[tuple[bool, float]]:
    """Lower the held object from above its place, until it touches something.

    Return whether the place was reached, and the height of the hand above it.

    Args:
        context: The skill's.
        place_B_P: Pose of P at the place, below the present one and of the same orientation.
        approach_m_s: Speed down to `SLOW_FROM_M` above it.
        lower_m_s: Speed of setting down.

    Raises:
        MotionRefused: Before moving.
    """
    near = Pose(place_B_P.position_m + np.array([0.0, 0.0, SLOW_FROM_M]), place_B_P.quat)
    reached = yield from glide(context, near, approach_m_s)
    reached = reached and (yield from glide(context, place_B_P, lower_m_s))
    return reached, float(context.arm.pose_B_P.position_m[2] - place_B_P.position_m[2])


def let_jaws_rest(arm: Arm) -> Motion[None]:
    """Wait until the jaws rest: jaws that are still closing would look like jaws that hold something."""
    watch = JawRestDetector(arm.period_s)
    for _ in range(round(JAW_REST_S / arm.period_s)):
        (seen,) = yield from arm.hold(arm.period_s)
        if watch.still(seen.now_s, seen.gripper):
            return
