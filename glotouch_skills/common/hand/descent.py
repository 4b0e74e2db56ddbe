"""Descent of the open fingers beside an object, as fast as the knowledge of the space below them allows."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import FREE_M_S, Arm, Motion, Paces
from glotouch_bt.robot import Array, Pose
from glotouch_bt.skill import Context
from glotouch_skills.common.hand.fingertips import ALONG, fingertip_places, fingertips_K_m
from glotouch_skills.common.hand.hand import glide

BESIDE_M_S = 0.03
"""Speed of the fingers beside the object where space was felt to be free. Source: at 0.05 m/s, an arm that stood out
beside the felt space stopped the robot (`bench retrieve --conditions realistic`, nailong of seed 41003, 71d5f16)."""
ABOVE_RATIO = 3.0
"""Speed above an object, where nothing else is known, over the slow speed. Source: ours."""
OVER_TOP_M = 0.02
"""Height above an object's top from which the hand counts as beside it. Source: ours."""
FOOT_M = 0.015
"""Height of the fingertips above the floor from which they are slow: the probe's ball passes 12 mm above the floor and
does not feel a foot that is lower. Source: `ExploringSpeeds.height_m` less the ball's radius, and 3 mm."""
FELT_WITHIN_M = 0.010
"""The space below a finger was felt if the tool stood within this distance of every place on its inner edge. What
reaches under the finger from the object would have been touched there. Source: ours; ball and shaft have radii of 6
and 4 mm."""


def descend(context: Context, goal_B_P: Pose, opening_m: float, top_m: float, slow_m_s: float) -> Motion[bool]:
    """Move the open hand from above an object straight down beside it; return False if the fingers touched something.

    Where the held probe has felt free space between object and fingers, or the open fingers stood before, only the
    millimetres below are slow. Else the fingers are slow from just above the top on.

    Args:
        context: The skill's.
        goal_B_P: Goal of P in B.
        opening_m: Aperture.
        top_m: Height of the object's top above the floor; infinite if unknown.
        slow_m_s: Speed towards what may be there.

    Raises:
        MotionRefused: Before moving.
    """
    arm = context.arm
    edges = _inner_edges(arm, goal_B_P, opening_m)
    tips = fingertips_K_m(arm, arm.pose_B_P)
    beside = max(tips - top_m - OVER_TOP_M, 0.0)
    paces: Paces = ((0.0, ABOVE_RATIO * slow_m_s), (beside, slow_m_s))
    free_m = arm.felt.free_down_to(edges, FELT_WITHIN_M)
    if np.isfinite(free_m):
        paces = ((0.0, FREE_M_S), (beside, BESIDE_M_S), (max(tips - max(free_m, FOOT_M), beside), slow_m_s))
    reached = yield from glide(context, goal_B_P, FREE_M_S, paces)
    if reached:
        note_open_fingers(arm)
    else:
        arm.felt.forget_free_near(edges.mean(axis=0))
    return reached


def note_open_fingers(arm: Arm) -> None:
    """Record that the open fingers stand free where they are."""
    arm.felt.add_hand(_inner_edges(arm, arm.pose_B_P, arm.aperture_m), fingertips_K_m(arm, arm.pose_B_P))


def _inner_edges(arm: Arm, goal_B_P: Pose, opening_m: float) -> Array:
    """Return places (n, 2) in K on the inner edges of both fingers at a pose."""
    return np.concatenate(fingertip_places(arm, goal_B_P, opening_m)[:, :ALONG])
