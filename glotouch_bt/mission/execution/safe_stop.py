"""The safe stop: the arm comes to rest, rises out of the container if it is free, and holds."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import MotionRefused, Observation
from glotouch_bt.skill import Context, SkillFailed, come_to_rest

RISE_M_S = 0.05
"""Speed of the rise, m/s."""
MAX_RISE_FORCE_N = 3.0
"""Stop the rise when the force differs from the one at rest by more than this: something holds the hand."""
GRIPPING_N = 1.0
"""Gripper force above which the jaws hold something."""
OVER_RIM_M = 0.03
"""Clearance of the lowest part above the container's rim."""
MAX_RISE_M = 0.35
"""Longest rise."""
REST_S = 0.1
"""Time over which the force at rest is averaged."""


def stop_safely(context: Context) -> Motion[str]:
    """Come to rest, then rise until the lowest part is above the container's rim; return what was done, in words.

    Do not rise if the jaws hold an object other than the probe: the rise could tear it out or drop it.
    """
    arm = context.arm
    try:
        yield from come_to_rest(context)
    except SkillFailed as e:
        return f"stopped; {e}"
    blocks = yield from arm.hold(REST_S)
    if blocks[-1].gripper.force_N > GRIPPING_N and not arm.scene.holding_tool:
        return "stopped and held: the jaws hold something"
    world, hand = context.world, arm.description.gripper
    below_m = world.probe.grasp_to_tip_m if arm.scene.holding_tool else hand.fingertip_below_P_m
    height_m = float(world.container.pose_B_K.inverse().apply(arm.pose_B_P.position_m)[2])
    up_m = min(world.container.interior_m[2] + below_m + OVER_RIM_M - height_m, MAX_RISE_M)
    if up_m < 1e-3:
        return "stopped and held above the container"
    rest_N = np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0)

    def guard(seen: Observation) -> str | None:
        excess_N = np.linalg.norm(seen.wrench_S[:, :3].mean(axis=0) - rest_N)
        return "held back" if excess_N > MAX_RISE_FORCE_N else None

    try:
        result = yield from arm.shift([0.0, 0.0, up_m], RISE_M_S, guard=guard, check=False, what="rise")
    except MotionRefused as refusal:
        return f"stopped and held: {refusal}"
    if result.stop is not None:
        return f"stopped and held: something held the hand back {result.travelled_m * 1e3:.0f} mm above where it was"
    return f"stopped, raised by {up_m * 1e3:.0f} mm, held"
