"""Raise the hand straight up until its lowest part is clear of everything in the container."""

from __future__ import annotations

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.robot import MotionRefused
from glotouch_skills.common.hand.line_guard import UP_B, describe_stop, straight_guard

CLEAR_M = 0.14
"""Height above the container's floor that clears its walls (80 mm) and any object. Source: the hand's body lets the
fingers down over 131 mm; a leaning object of 1 % more is up to 137 mm high."""
RISE_M_S = 0.10
"""Default speed of rising."""
NEAR_ENOUGH_M = 0.002
"""Do not rise by less than this."""
CAUGHT_N = 15.0
"""Change of force that stops the rise: half of the robot's hard limit. The heaviest object of
conditions/nominal.yaml weighs 4 N."""


def rise_clear(arm: Arm, speed_m_s: float = RISE_M_S) -> Motion[float]:
    """Rise to `CLEAR_M` if the hand is lower, without turning it or moving its jaws; return the height gained, m.

    The lowest point is the ball while the probe is held, else the fingertips.

    Raises:
        MotionRefused: The arm cannot reach that height there, or the hand is caught under something.
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
    if (why := describe_stop(moved)) is not None:
        raise MotionRefused("rise", why)
    return short
