"""Straight up until what hangs lowest in the hand is clear of everything in the container."""

from __future__ import annotations

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.robot import MotionRefused
from glotouch_skills.common.hand.line_guard import UP_B, straight_guard, why_stopped

CLEAR_M = 0.13
"""Height over the container's floor that clears its walls (80 mm) and any object, as the skills' own headroom."""
RISE_M_S = 0.10
NEAR_ENOUGH_M = 0.002
CAUGHT_N = 15.0
"""Change of force at which the hand rises no farther, half of the robot's hard limit: it is caught. What it takes up
weighs 4 N at most (CONDITIONS)."""


def rise_clear(arm: Arm, speed_m_s: float = RISE_M_S) -> Motion[float]:
    """Up, if it is lower; the hand is not turned and its jaws are left as they are. How far it rose, m.

    The lowest point is the ball while the probe is held, else the fingertips.

    Raises:
        MotionRefused: The arm does not reach so high there, or the hand is caught under something.
        GuardTripped: The arm does not follow its setpoints.
    """
    world = arm.world
    below = arm.description.gripper.fingertip_below_P_m
    if arm.scene.holding_tool:
        below = world.probe.grasp_to_tip_m + world.probe.tip_radius_m
    height = float(world.container.pose_B_K.inverse().apply(arm.pose_B_P.position_m)[2]) - below
    short = CLEAR_M - height
    if short <= NEAR_ENOUGH_M:
        return 0.0
    guard = yield from straight_guard(arm, UP_B, CAUGHT_N)
    moved = yield from arm.shift(short * UP_B, speed_m_s, check=False, guard=guard, what="rise")
    if (why := why_stopped(moved)) is not None:
        raise MotionRefused("rise", why)
    return short
