"""Close the jaws once across a push: the object then stands in their middle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array, Gripper, MotionRefused
from glotouch_bt.skill import Context
from glotouch_skills.common.hand import rise_clear
from glotouch_skills.common.planning import (
    ClosureParams,
    Neighbour,
    Squeezing,
    Stance,
    displaced,
    finger_clearance_m,
    layer_heights,
)

GAPS_M = (0.012, 0.010, 0.008)
"""Gaps between open jaw and object on each side to try: objects move up to 7 mm across a push (`bench space`,
realistic, seeds 57062-57073)."""
TURNS_DEG = (0.0, 20.0, -20.0, 40.0, -40.0)
"""Turns of the jaws from the direction of the push to try: a neighbour or a wall may leave no space beside it. Source:
ours."""
SPACE_M = 0.003
"""Least distance of the open fingers from neighbours and walls. Source: the planner refuses less than 2 mm."""
CENTRED_SD_M = 0.0015
"""Standard deviation of the object's centre against the middle of the closed jaws. Source: ours; the outline need not
be symmetrical."""


def across_push(
    candidate: Candidate,
    yaw_K_rad: float,
    gripper: Gripper,
    others: Sequence[Candidate] = (),
    half_extent_m: Array | None = None,
) -> Stance | str:
    """Return the stance of the open jaws over a pushed object, closing across the push, or why there is none.

    The jaws are turned, and opened less, if neighbours or walls leave no space.

    Args:
        candidate: The object after the push.
        yaw_K_rad: Direction of the push.
        gripper: The robot's gripper.
        others: The other objects.
        half_extent_m: (2,) half of the container's interior; None: no walls.
    """
    half = np.full(2, math.inf) if half_extent_m is None else half_extent_m
    neighbours = [Neighbour.of(other) for other in others]
    why_not = "it is too wide for the open jaws"
    for turn in np.deg2rad(TURNS_DEG):
        yaw = yaw_K_rad + float(turn)
        low, high = candidate.span_m(yaw + 0.5 * math.pi)
        along_K = np.array([math.cos(yaw), math.sin(yaw)])
        across_K = np.array([-along_K[1], along_K[0]])
        middle_K_m = float(candidate.contour.centre_K_m @ along_K) * along_K + 0.5 * (low + high) * across_K
        for gap_m in GAPS_M:
            at = Stance(middle_K_m, yaw, high - low + 2.0 * gap_m, high - low)
            if at.opening_m > gripper.stroke_m:
                continue
            if finger_clearance_m(at, neighbours, half, gripper) >= SPACE_M:
                return at
            why_not = "neighbours or walls leave no space for the open fingers"
    return why_not


def centred(
    context: Context, candidate: Candidate, yaw_K_rad: float, others: Sequence[Candidate]
) -> Motion[tuple[Candidate | None, str]]:
    """Close the jaws on a pushed object; return it where it stands then, or None and why nothing is known.

    The hand is high before and afterwards.

    Args:
        context: The skill's.
        candidate: The object after the push.
        yaw_K_rad: Direction of the push.
        others: The other objects.
    """
    arm, params = context.arm, ClosureParams()
    gripper = arm.description.gripper
    half_extent_m = 0.5 * np.array(context.world.container.interior_m[:2])
    at = across_push(candidate, yaw_K_rad, gripper, others, half_extent_m)
    if isinstance(at, str):
        return None, at
    hand = Squeezing(context, candidate, at, params)
    try:
        yield from hand.go_down(float(layer_heights(candidate, gripper, params)[0]))
        layer, _ = yield from hand.close()
    except MotionRefused as refusal:
        yield from rise_clear(arm)
        return None, str(refusal)
    yield from hand.rise()
    if not layer.stable:
        return None, layer.why_not
    # The place along the push is known. What the jaws feel is the displacement across it, seen along their own axis.
    closing_K = np.array([-math.sin(at.yaw_K_rad), math.cos(at.yaw_K_rad)])
    across_K = np.array([-math.sin(yaw_K_rad), math.cos(yaw_K_rad)])
    off_m = float((layer.position_K_m - at.position_K_m) @ closing_K) / float(closing_K @ across_K)
    return displaced(candidate, off_m * across_K), ""
