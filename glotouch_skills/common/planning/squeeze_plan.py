"""Stances of the open jaws: three yaws over a round candidate, three parallel tracks over a box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.motion import Arm, Motion, hand_pose_B
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import HOLD, Array, Container, Gripper, MotionRefused
from glotouch_skills.common.hand import CLEARANCE_M, require_clear

MIN_SIDE_GAP_M = 0.004
"""Least gap between open jaw and object on each side."""
NARROW_RATIO = 0.5
"""Smallest gap to try over the preferred one. Source: ours."""
TURNS_RAD = np.deg2rad([0.0, 60.0, -60.0])
"""Yaws of the three sequences on a round candidate, relative to the base yaw."""
BASES_RAD = np.deg2rad([0.0, 15.0, -15.0, 30.0])
"""Base yaws to try on a round candidate; with the three turns, they cover half a circle in steps of 15 degrees."""
ROUND_DEVIATIONS_RAD = np.deg2rad([0.0, 8.0, -8.0])
"""Deviations from each of the three yaws to try where the hand would collide."""
TRACK_DEVIATIONS_RAD = np.deg2rad([0.0, 6.0, -6.0])
"""Deviations from a box's long side to try where a track would collide."""


@dataclass(frozen=True)
class Stance:
    """An open hand over a candidate.

    Attributes:
        position_K_m: (2,) pads' mid-point.
        yaw_K_rad: Direction of x_P.
        opening_m: Aperture during the descent.
        span_m: Extent of the candidate between the fingers.
    """

    position_K_m: Array
    yaw_K_rad: float
    opening_m: float
    span_m: float

    def opened(self, side_gap_m: float, gripper: Gripper) -> Stance:
        """Return the stance with a gap between open jaw and candidate on each side, as far as the stroke allows."""
        return replace(self, opening_m=min(self.span_m + 2 * side_gap_m, gripper.stroke_m))


def side_gaps_m(side_gap_m: float) -> tuple[float, float]:
    """Return the gaps between open jaw and candidate to try, widest first: neighbours may leave less space."""
    return side_gap_m, max(NARROW_RATIO * side_gap_m, MIN_SIDE_GAP_M)


def stance(
    candidate: Candidate, along_m: float, yaw_K_rad: float, side_gap_m: float, gripper: Gripper
) -> Stance | None:
    """Return the stance `along_m` from the candidate's centre along `yaw_K_rad`, in the middle of its extent across.

    None if the candidate does not fit between the jaws there. Of an irregular outline that is too wide as a whole, only
    what lies between the fingers must fit.
    """
    contour, stroke_m = candidate.contour, gripper.stroke_m
    x = np.array([np.cos(yaw_K_rad), np.sin(yaw_K_rad)])
    y = np.array([-x[1], x[0]])
    low, high = candidate.span_m(yaw_K_rad + 0.5 * np.pi)
    widest_m = stroke_m - 2 * MIN_SIDE_GAP_M
    if high - low > widest_m and contour.family == "free":
        half_m = gripper.finger.half_m[0] + MIN_SIDE_GAP_M
        low, high = candidate.strip_span_m(yaw_K_rad + 0.5 * np.pi, contour.centre_K_m + along_m * x, half_m)
    if high - low > widest_m:
        return None
    position = (contour.centre_K_m @ x + along_m) * x + 0.5 * (low + high) * y
    return Stance(position, yaw_K_rad, stroke_m, float(high - low)).opened(side_gap_m, gripper)


Scheme = list[list[tuple[float, float]]]
"""Sequences, each a list of alternatives (along m, yaw rad), preferred first."""


def schemes(candidate: Candidate, gripper: Gripper) -> list[Scheme]:
    """Return schemes of three sequences, preferred first.

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


def all_sides(candidate: Candidate, gripper: Gripper, count: int) -> Scheme:
    """Return a scheme of `count` sequences from all sides: first the tracks of a box, if there are that many."""
    contour = candidate.contour
    tracks = schemes(candidate, gripper)[0][:count] if contour.kind == "box" else []
    turns = count - len(tracks)
    step = np.pi / (turns + bool(tracks))
    first = contour.yaw_rad + (0.5 * np.pi if len(tracks) else 0.0)
    away = np.clip(ROUND_DEVIATIONS_RAD, -0.5 * step, 0.5 * step)
    return tracks + [[(0.0, float(first + k * step + a)) for a in away] for k in range(turns)]


def plan_stances(
    candidate: Candidate,
    arm: Arm,
    container: Container,
    pads_height_m: float,
    gaps_m: Sequence[float],
    choices: Sequence[Scheme] = (),
) -> Motion[tuple[list[Stance], list[str]]]:
    """Return the stances of the scheme with the most free sequences, and the refusals of the others.

    Hold the arm for one period a check.

    Args:
        candidate: Object to squeeze.
        arm: Arm whose scene has the other candidates as obstacles.
        container: The registered container.
        pads_height_m: Lowest height of P above the floor.
        gaps_m: Gaps between open jaw and object to try, widest first; see `side_gaps_m`.
        choices: Schemes to try, preferred first (default: `schemes`).
    """
    gripper = arm.description.gripper
    best: list[Stance] = []
    refusals: list[str] = []
    for scheme in choices or schemes(candidate, gripper):
        found: list[Stance] = []
        for alternatives in scheme:
            chosen = yield from _first_free(candidate, alternatives, arm, container, pads_height_m, gaps_m, refusals)
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
    gaps_m: Sequence[float],
    refusals: list[str],
) -> Motion[Stance | None]:
    for along, yaw in alternatives:
        for gap in gaps_m:
            at = stance(candidate, along, yaw, gap, arm.description.gripper)
            if at is None:
                refusals.append(f"wider than the jaws open at yaw {np.rad2deg(yaw):.0f} deg")
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
