"""Descent of the open fingers beside an object, as fast as the knowledge of the space below them allows."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import FREE_M_S, Arm, FeltSpace, Motion, SpeedSteps
from glotouch_bt.robot import Array, Pose
from glotouch_bt.skill import Context
from glotouch_skills.common.hand.fingertips import fingertips_K_m, inner_edges
from glotouch_skills.common.hand.hand import glide

BESIDE_M_S = 0.02
"""Speed of the fingers beside the object where space was felt to be free. The record can be wrong: at 0.05 m/s, an arm
that stood out beside the felt space stopped the robot (`bench retrieve --conditions realistic`, nailong of seed 41003,
71d5f16). At 0.03 m/s, the fingers met an object with 25 N (`bench speed --trials 10 --seed 59180`, aa5cf689)."""
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
    edges = _edges_under(arm, goal_B_P, opening_m)
    speed_steps = descent_speed_steps(arm.felt, edges, fingertips_K_m(arm, arm.pose_B_P), top_m, slow_m_s)
    reached = yield from glide(context, goal_B_P, FREE_M_S, speed_steps)
    if reached:
        note_open_fingers(arm)
    else:
        arm.felt.forget_free_near(edges.mean(axis=0))
    return reached


def descent_speed_steps(
    felt: FeltSpace, edges_K_m: Array, tips_K_m: float, top_m: float, slow_m_s: float
) -> SpeedSteps:
    """Return the speeds of a descent of the fingertips, each from a distance below `tips_K_m` on.

    Args:
        felt: Where the probe and the fingers stood.
        edges_K_m: (n, 2) places under the inner edges of the fingertips.
        tips_K_m: Height of the fingertips above the floor at the start.
        top_m, slow_m_s: As for `descend`.
    """
    free_m = felt.free_down_to(edges_K_m, FELT_WITHIN_M)
    if not np.isfinite(free_m):
        return unfelt_speed_steps(tips_K_m, top_m, slow_m_s)
    beside = max(tips_K_m - top_m - OVER_TOP_M, 0.0)
    return (0.0, FREE_M_S), (beside, BESIDE_M_S), (max(tips_K_m - max(free_m, FOOT_M), beside), slow_m_s)


def unfelt_speed_steps(tips_K_m: float, top_m: float, slow_m_s: float) -> SpeedSteps:
    """Return the speeds, as `descent_speed_steps`, where nothing was felt."""
    return (0.0, ABOVE_RATIO * slow_m_s), (max(tips_K_m - top_m - OVER_TOP_M, 0.0), slow_m_s)


def seconds_at(speed_steps: SpeedSteps, length_m: float) -> float:
    """Return the time of a straight way at the given speeds, without starting and stopping."""
    ends = [min(begin, length_m) for begin, _ in speed_steps[1:]] + [length_m]
    return sum(max(end - begin, 0.0) / speed for (begin, speed), end in zip(speed_steps, ends, strict=True))


def note_open_fingers(arm: Arm) -> None:
    """Record that the open fingers stand free where they are."""
    arm.felt.add_hand(_edges_under(arm, arm.pose_B_P, arm.aperture_m), fingertips_K_m(arm, arm.pose_B_P))


def _edges_under(arm: Arm, pose_B_P: Pose, opening_m: float) -> Array:
    return inner_edges(arm.description.gripper, arm.world.container.pose_B_K.inverse() @ pose_B_P, opening_m)
