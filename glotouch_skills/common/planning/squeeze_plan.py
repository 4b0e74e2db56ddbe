"""Stances of the open jaws: three yaws over a round candidate, three parallel tracks over a box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Arm, Motion, hand_pose_B
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import HOLD, Array, Container, Gripper, MotionRefused
from glotouch_skills.common.hand import CLEARANCE_M, require_clear

MIN_SIDE_GAP_M = 0.004
"""Least gap between open jaw and object on each side."""
TURNS_RAD = np.deg2rad([0.0, 60.0, -60.0])
"""Yaws of the three sequences on a round candidate, relative to the base yaw."""
BASES_RAD = np.deg2rad([0.0, 15.0, -15.0, 30.0])
"""Base yaws to try on a round candidate; with the three turns, they cover half a circle in steps of 15 degrees."""
ROUND_DEVIATIONS_RAD = np.deg2rad([0.0, 8.0, -8.0])
"""Deviations from each of the three yaws to try where the hand would collide."""
TRACK_DEVIATIONS_RAD = np.deg2rad([0.0, 6.0, -6.0])
"""Deviations from a box's long side to try where a track would collide."""
STRIP_MARGIN_M = 0.003
"""What of the object is within this of a finger along x_P counts as between the jaws. Source: ours; the standard
deviation of a sequence's shift in `recognition`."""

MAX_SLOPE = 0.2
"""Largest slope of the outline under the end of a pad beside the centre. On a steeper side the end of the gel carries
all force: 12 to 22 mm beside the centre of a ring, widths were 1 to 3 mm too small. Source: simulation, realistic."""
SLOPE_OVER_M = 0.003
"""Length over which that slope is taken."""


@dataclass(frozen=True)
class Stance:
    """An open hand over a candidate.

    Attributes:
        position_K_m: (2,) pads' mid-point.
        yaw_K_rad: Direction of x_P.
        opening_m: Aperture during the descent.
    """

    position_K_m: Array
    yaw_K_rad: float
    opening_m: float


def stance(
    candidate: Candidate, along_m: float, yaw_K_rad: float, side_gap_m: float, gripper: Gripper
) -> Stance | None:
    """Return the stance `along_m` from the candidate's centre along `yaw_K_rad`, in the middle of what is across there.

    Only what stands between the fingers counts, so the jaws also fit over a limb, or one side of a ring. None if the
    candidate is not there, does not fit between the jaws, or is steep there.
    """
    x = np.array([np.cos(yaw_K_rad), np.sin(yaw_K_rad)])
    y = np.array([-x[1], x[0]])
    place = float(candidate.contour.centre_K_m @ x) + along_m
    span = candidate.strip_span_m(yaw_K_rad, place, gripper.finger.half_m[0] + STRIP_MARGIN_M)
    if span is None or span[1] - span[0] > gripper.stroke_m - 2 * MIN_SIDE_GAP_M:
        return None
    if along_m != 0.0 and _is_steep(candidate, place, yaw_K_rad, 0.5 * gripper.pad_window_m[0]):
        return None
    low, high = span
    position = place * x + 0.5 * (low + high) * y
    return Stance(position, yaw_K_rad, min(high - low + 2 * side_gap_m, gripper.stroke_m))


def _is_steep(candidate: Candidate, place_m: float, yaw_K_rad: float, half_pad_m: float) -> bool:
    """Return True if a pad would touch with one end only, where the outline is steep."""
    whole, inner = (candidate.strip_span_m(yaw_K_rad, place_m, half_pad_m - d) for d in (0.0, SLOPE_OVER_M))
    if whole is None or inner is None:
        return True
    return max(inner[0] - whole[0], whole[1] - inner[1]) > MAX_SLOPE * SLOPE_OVER_M


def schemes(candidate: Candidate, gripper: Gripper) -> list[list[list[tuple[float, float]]]]:
    """Return schemes of three sequences, preferred first; each sequence is a list of (along, yaw) alternatives.

    For a free outline, the yaws start from its long side. One that is squeezed like a box may also be squeezed at three
    yaws, if some of its tracks would collide.
    """
    contour = candidate.contour
    first = contour.yaw_rad if contour.family == "free" else 0.0
    turned = [
        [[(0.0, float(first + base + turn + away)) for away in ROUND_DEVIATIONS_RAD] for turn in TURNS_RAD]
        for base in BASES_RAD
    ]
    if contour.kind == "round":
        return turned
    reach = max(0.5 * contour.size_m[0] - 0.5 * gripper.pad_window_m[0], 0.0)
    track = min(0.25 * contour.size_m[0], reach)
    tracks = [[(t, contour.yaw_rad + float(s)) for s in TRACK_DEVIATIONS_RAD] for t in (-track, 0.0, track)]
    return [tracks, *turned] if contour.family == "free" else [tracks]


def plan_stances(
    candidate: Candidate, arm: Arm, container: Container, pads_height_m: float, side_gaps_m: Sequence[float]
) -> Motion[tuple[list[Stance], list[str]]]:
    """Return the stances of the scheme with the most free sequences, and the refusals of the others.

    Hold the arm for one period a check.

    Args:
        candidate: Object to squeeze.
        arm: Arm whose scene has the other candidates as obstacles.
        container: The registered container.
        pads_height_m: Lowest height of P above the floor.
        side_gaps_m: Gaps between open jaw and object to try, widest first.
    """
    gripper = arm.description.gripper
    best: list[Stance] = []
    refusals: list[str] = []
    for scheme in schemes(candidate, gripper):
        found: list[Stance] = []
        for alternatives in scheme:
            chosen = yield from _first_free(
                candidate, alternatives, arm, container, pads_height_m, side_gaps_m, refusals
            )
            if chosen is not None:
                found.append(chosen)
        if len(found) > len(best):
            best = found
        if len(best) == len(scheme):
            break
    return best, refusals


def _first_free(
    candidate: Candidate,
    alternatives: Sequence[tuple[float, float]],
    arm: Arm,
    container: Container,
    pads_height_m: float,
    side_gaps_m: Sequence[float],
    refusals: list[str],
) -> Motion[Stance | None]:
    for along, yaw in alternatives:
        for gap in side_gaps_m:
            at = stance(candidate, along, yaw, gap, arm.description.gripper)
            if at is None:
                refusals.append(f"wider than the jaws open, or steep, at yaw {np.rad2deg(yaw):.0f} deg")
                break
            pose = hand_pose_B(arm, container, np.array([*at.position_K_m, pads_height_m]), yaw)
            yield HOLD
            try:
                require_clear(arm, pose, at.opening_m, CLEARANCE_M)
            except MotionRefused as refusal:
                refusals.append(str(refusal))
                continue
            return at
    return None
