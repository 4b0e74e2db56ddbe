"""Grasps of an object of which only outline and height are known.

Planar, in K. The outline is that of the sensing height. The jaws close across its narrow side, at middle
height, and the open fingers keep clear of neighbours and walls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array, Gripper
from glotouch_skills.common.hand import CLEARANCE_M
from glotouch_skills.common.planning.finger_space import Neighbour, finger_clearance_m
from glotouch_skills.common.planning.grasp_plan import ALTERNATIVES, APART_M, APART_RAD, GraspPlan
from glotouch_skills.common.planning.squeeze_motion import lowest_pads_m
from glotouch_skills.common.planning.squeeze_plan import Stance, stance

YAWS_RAD = np.deg2rad(np.arange(0.0, 180.0, 15.0))
"""Yaws of x_P to try, from the outline's long side; half a turn suffices for parallel jaws."""
ALONG_M = (0.0, 0.012, -0.012)
"""Places along x_P to try, from the outline's centre, which stands for the centre of mass. Source: `APART_M`."""
SIDE_GAPS_M = (0.014, 0.010, 0.006)
"""Gaps between open jaw and outline on each side to try, widest first: a wider object above the sensing height still
fits between the jaws."""
HEIGHT_RATIO = 0.55
"""Height of the pads over the object's: just above the centre of mass of an even body, which then hangs upright as a
pendulum. At 0.45, a figure of 100 mm that was touched by little of the pads turned by 30 degrees."""
MARGIN_M = 0.001
"""Clearance of the open fingers beyond `CLEARANCE_M`. Source: sampling of outlines."""
WIDTH_COST = 1.0
"""Cost of a metre of width: a narrow side is nearly parallel to the jaws, and leaves the fingers more space."""
ALONG_COST = 0.5
"""Cost of a metre of distance from the centre: the object would turn about the pads."""
SPACE_GAIN = 0.3
"""Gain of a metre of clearance, up to `ENOUGH_M`."""
ENOUGH_M = 0.015
"""See `SPACE_GAIN`. More space than this is of no use."""


def outline_grasp(
    candidate: Candidate, neighbours: Sequence[Neighbour], half_extent_m: Array, gripper: Gripper
) -> GraspPlan | None:
    """Return the best grasp of an object, with alternatives by yaw, place and height; None if the fingers fit nowhere.

    Args:
        candidate: The object.
        neighbours: The other objects.
        half_extent_m: (2,) half of the container's interior.
        gripper: The robot's gripper.
    """
    rated = sorted(_rated(candidate, neighbours, half_extent_m, gripper), key=lambda r: r[0])
    chosen: list[Stance] = []
    for _, at in rated:
        if len(chosen) <= ALTERNATIVES // 2 and not any(_near(at, other) for other in chosen):
            chosen.append(at)
    plans = [_plan(candidate, at, z) for z in pad_heights(candidate.height_m, gripper) for at in chosen]
    if not plans:
        return None
    first, *others = plans[: 1 + ALTERNATIVES]
    return GraspPlan(
        first.candidate, first.position_K_m, first.yaw_rad, first.aperture_m, first.opening_m, tuple(others)
    )


def pad_heights(height_m: float, gripper: Gripper) -> tuple[float, ...]:
    """Return the heights of the pads' mid-point above the floor to try: the middle, then as low as possible.

    Args:
        height_m: Height of the object.
        gripper: The gripper; fingertips stay clear of the floor, its body of the object's top.
    """
    lowest = lowest_pads_m(height_m, gripper)
    middle = max(HEIGHT_RATIO * height_m, lowest)
    return (middle,) if middle - lowest < APART_M / 2 else (middle, lowest)


def _rated(
    candidate: Candidate, neighbours: Sequence[Neighbour], half_extent_m: Array, gripper: Gripper
) -> list[tuple[float, Stance]]:
    """Return the stances whose open fingers are clear, each at its widest gap, with their costs."""
    found = []
    for yaw in candidate.contour.yaw_rad + YAWS_RAD:
        for along in ALONG_M:
            for gap in SIDE_GAPS_M:
                at = stance(candidate, along, float(yaw), gap, gripper)
                if at is None:
                    break
                space = finger_clearance_m(at, neighbours, half_extent_m, gripper)
                if space >= CLEARANCE_M + MARGIN_M:
                    cost = WIDTH_COST * at.opening_m + ALONG_COST * abs(along) - SPACE_GAIN * min(space, ENOUGH_M)
                    cost -= (WIDTH_COST + SPACE_GAIN) * 2 * gap  # of two gaps, the wider one is better
                    found.append((cost, at))
                    break
    return found


def _near(one: Stance, other: Stance) -> bool:
    """Return True if two stances differ in neither yaw nor place."""
    turned = abs(math.remainder(one.yaw_K_rad - other.yaw_K_rad, math.pi))
    return turned < APART_RAD and float(np.linalg.norm(one.position_K_m - other.position_K_m)) < APART_M - 1e-6


def _plan(candidate: Candidate, at: Stance, height_m: float) -> GraspPlan:
    low, high = candidate.span_m(at.yaw_K_rad + 0.5 * math.pi)
    return GraspPlan(
        candidate=candidate.index,
        position_K_m=np.array([*at.position_K_m, height_m]),
        yaw_rad=math.remainder(at.yaw_K_rad, 2 * math.pi),
        aperture_m=min(high - low, at.opening_m),
        opening_m=at.opening_m,
    )
