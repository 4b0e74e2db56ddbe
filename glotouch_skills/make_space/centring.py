"""Close the jaws once across a push: the object then stands in their middle."""

from __future__ import annotations

import math

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Gripper, MotionRefused
from glotouch_bt.skill import Context
from glotouch_skills.common.hand import rise_clear
from glotouch_skills.common.planning import ClosureParams, Squeezing, Stance, displaced, layer_heights

GAP_M = 0.012
"""Gap between open jaw and object on each side, as far as the stroke allows: objects move up to 7 mm across a push
(`bench space`, realistic, seeds 57062-57073)."""
MIN_GAP_M = 0.008
"""Least such gap. Source: ours."""
CENTRED_SD_M = 0.0015
"""Standard deviation of the object's centre against the middle of the closed jaws. Source: ours; the outline need not
be symmetrical."""


def across_push(candidate: Candidate, yaw_K_rad: float, gripper: Gripper) -> Stance | None:
    """Return the stance of the open jaws over a pushed object, closing across the push; None if it is too wide.

    Args:
        candidate: The object after the push.
        yaw_K_rad: Direction of the push.
        gripper: The robot's gripper.
    """
    low, high = candidate.span_m(yaw_K_rad + 0.5 * math.pi)
    gap_m = min(GAP_M, 0.5 * (gripper.stroke_m - (high - low)))
    if gap_m < MIN_GAP_M:
        return None
    along_K = np.array([math.cos(yaw_K_rad), math.sin(yaw_K_rad)])
    across_K = np.array([-along_K[1], along_K[0]])
    middle_K_m = float(candidate.contour.centre_K_m @ along_K) * along_K + 0.5 * (low + high) * across_K
    return Stance(middle_K_m, yaw_K_rad, high - low + 2.0 * gap_m, high - low)


def centred(context: Context, candidate: Candidate, yaw_K_rad: float) -> Motion[tuple[Candidate | None, str]]:
    """Close the jaws on a pushed object; return it where it stands then, or None and why nothing is known.

    The hand is high before and afterwards.

    Args:
        context: The skill's.
        candidate: The object after the push.
        yaw_K_rad: Direction of the push.
    """
    arm, params = context.arm, ClosureParams()
    gripper = arm.description.gripper
    at = across_push(candidate, yaw_K_rad, gripper)
    if at is None:
        return None, "it is too wide for the open jaws"
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
    across_K = np.array([-math.sin(yaw_K_rad), math.cos(yaw_K_rad)])
    return displaced(candidate, float((layer.position_K_m - at.position_K_m) @ across_K) * across_K), ""
