"""Putting the probe into its holder: shared by `tool_return` and `stow`."""

from __future__ import annotations

import dataclasses

import numpy as np

from glotouch_bt.robot import MotionRefused, Pose, SetPayload, Tare
from skills.base import Context, SkillRun
from skills.requests import finish
from skills.straight import DOWN_B, Strayed, straight_guard, why_stopped

OVER_HOLDER_M = 0.002
"""This near to the holder's axis the probe is in it, or on its way in (the skill was broken off there)."""
NEAR_M, LAST_M_S = 0.02, 0.01
"""From so far above its place it is lowered slowly, by the second."""
STANDS_N = 8.0
"""Change of force at which it stands before its time: it slipped down in the jaws."""
OVER_STOWED_M = 0.08
"""The empty hand rises so far from the stowed probe's handle."""


def return_probe(
    context: Context, yaw_B_rad: float, aperture_m: float, *, speed_m_s: float, insert_speed_m_s: float
) -> SkillRun:
    """Over the holder, in until it stands, open the jaws, rise, tell the controller, tare.

    Args:
        context: The skill's.
        yaw_B_rad: Yaw of x_P in B at which the probe was grasped.
        aperture_m: Opening of the jaws with the handle between them.
        speed_m_s, insert_speed_m_s: With the probe in the hand; into the holder.

    Raises:
        SkillFailed: `request_failed`; the probe stands in its holder.
        MotionRefused: The holder cannot be reached, or the hand is pressed aside; the probe is held.
        GuardTripped: The arm does not follow its setpoints; the probe is held.
    """
    arm, world = context.arm, context.world
    grasp = Pose.pointing_down(world.holder.pose_B_grasp.position_m, yaw_B_rad)
    above = dataclasses.replace(grasp, position_m=grasp.position_m + np.array([0.0, 0.0, world.probe.length_m + 0.06]))
    here = arm.pose_B_P.position_m
    if here[2] > above.position_m[2] or np.linalg.norm(here[:2] - above.position_m[:2]) > OVER_HOLDER_M:
        height = max(float(here[2]), float(above.position_m[2]))
        yield from arm.transit(above, height_B_m=height, speed_m_s=speed_m_s)
    near = dataclasses.replace(grasp, position_m=grasp.position_m + np.array([0.0, 0.0, NEAR_M]))
    if float(arm.pose_B_P.position_m[2]) > float(near.position_m[2]):
        yield from arm.line(near, insert_speed_m_s, check=False)
    guard = yield from straight_guard(arm, DOWN_B, STANDS_N)
    moved = yield from arm.line(grasp, min(LAST_M_S, insert_speed_m_s), check=False, guard=guard)
    why = why_stopped(moved)
    if isinstance(moved.stop, Strayed):
        raise MotionRefused("into the holder", str(why))
    yield from arm.jaws(min(aperture_m + 0.03, arm.description.gripper.stroke_m), speed_m_s=0.08)
    arm.scene.hold_tool(False)
    yield from arm.shift(np.array([0.0, 0.0, OVER_STOWED_M]), 0.08, check=False)
    yield from nothing_in_hand(context)


def nothing_in_hand(context: Context) -> SkillRun:
    """Tell the controller that the hand is empty, and zero the wrist.

    Raises:
        SkillFailed: `request_failed`.
    """
    yield from finish(context.requests.start(SetPayload(0.0, np.zeros(3))), "payload")
    yield from context.arm.hold(0.2)
    yield from finish(context.requests.start(Tare()), "tare")
