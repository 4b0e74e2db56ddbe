"""How a mission ends that is asked to stop: the arm comes to rest, rises if it is free, and is held."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import MotionRefused, Observation
from glotouch_bt.skill import Context, SkillFailed, come_to_rest

RISE_M_S = 0.05
RISE_N = 3.0
"""More than this beside what was felt at rest stops the rise: something holds the hand."""
GRIPPING_N = 1.0
OVER_RIM_M = 0.03
LONGEST_RISE_M = 0.35
REST_S = 0.1


def end_high(context: Context) -> Motion[str]:
    """Stop, and go straight up until what is lowest is above the container's rim; what was done, in words.

    Jaws that hold something other than the probe stay where they are: it would be torn out or dropped.
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
    up_m = min(world.container.interior_m[2] + below_m + OVER_RIM_M - height_m, LONGEST_RISE_M)
    if up_m < 1e-3:
        return "stopped and held above the container"
    rest_N = np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0)

    def held_back(seen: Observation) -> str | None:
        return "held back" if np.linalg.norm(seen.wrench_S[:, :3].mean(axis=0) - rest_N) > RISE_N else None

    try:
        result = yield from arm.shift([0.0, 0.0, up_m], RISE_M_S, guard=held_back, check=False, what="rise")
    except MotionRefused as refusal:
        return f"stopped and held: {refusal}"
    if result.stop is not None:
        return f"stopped and held: something held the hand back {result.travelled_m * 1e3:.0f} mm above where it was"
    return f"stopped, raised by {up_m * 1e3:.0f} mm, held"
