"""Where the open jaws may stand: at three yaws over a round candidate, on three parallel tracks over a box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Arm, Motion, hand_pose_B
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import HOLD, Array, Container, Gripper, MotionRefused
from glotouch_skills.common.hand import CLEARANCE_M, require_clear

MIN_SIDE_GAP_M = 0.004
TURNS_RAD = np.deg2rad([0.0, 60.0, -60.0])
BASES_RAD = np.deg2rad([0.0, 15.0, -15.0, 30.0])
"""Base yaws tried for a round candidate; with the three turns they cover half a circle every 15 degrees."""
LEEWAY_RAD = np.deg2rad([0.0, 8.0, -8.0])
"""Turns away from each of its three yaws tried when there is no room."""
SLACK_RAD = np.deg2rad([0.0, 6.0, -6.0])
"""Turns away from a box's long side tried when a track has no room."""


@dataclass(frozen=True)
class Stance:
    """An open hand over a candidate.

    Attributes:
        position_K_m: (2,) pads' mid-point.
        yaw_K_rad: Direction of x_P.
        opening_m: Aperture to go down with.
    """

    position_K_m: Array
    yaw_K_rad: float
    opening_m: float


def stance(candidate: Candidate, along_m: float, yaw_K_rad: float, side_gap_m: float, stroke_m: float) -> Stance | None:
    """The hand `along_m` from the candidate's centre along `yaw_K_rad`, midway of its traced extent across.

    None if the candidate does not fit between the jaws there.
    """
    x = np.array([np.cos(yaw_K_rad), np.sin(yaw_K_rad)])
    y = np.array([-x[1], x[0]])
    low, high = candidate.span_m(yaw_K_rad + 0.5 * np.pi)
    if high - low > stroke_m - 2 * MIN_SIDE_GAP_M:
        return None
    position = (candidate.contour.centre_K_m @ x + along_m) * x + 0.5 * (low + high) * y
    return Stance(position, yaw_K_rad, min(high - low + 2 * side_gap_m, stroke_m))


def schemes(candidate: Candidate, gripper: Gripper) -> list[list[list[tuple[float, float]]]]:
    """Ways to take three sequences, the preferred one first: for each sequence its (along, yaw) alternatives.

    A free outline is turned about from the direction of its long side. If it is squeezed like a box, but not all of its
    tracks have room, it may be turned about all the same.
    """
    contour = candidate.contour
    first = contour.yaw_rad if contour.family == "free" else 0.0
    turned = [
        [[(0.0, float(first + base + turn + away)) for away in LEEWAY_RAD] for turn in TURNS_RAD] for base in BASES_RAD
    ]
    if contour.kind == "round":
        return turned
    reach = max(0.5 * contour.size_m[0] - 0.5 * gripper.pad_window_m[0], 0.0)
    track = min(0.25 * contour.size_m[0], reach)
    tracks = [[(t, contour.yaw_rad + float(s)) for s in SLACK_RAD] for t in (-track, 0.0, track)]
    return [tracks, *turned] if contour.family == "free" else [tracks]


def plan_stances(
    candidate: Candidate, arm: Arm, container: Container, pads_height_m: float, side_gaps_m: Sequence[float]
) -> Motion[tuple[list[Stance], list[str]]]:
    """The scheme with the most sequences that have room, and why others have none. Holds the arm one period a check.

    Args:
        candidate: What to squeeze.
        arm: Its scene must know the other candidates.
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
            chosen = yield from _first_with_room(
                candidate, alternatives, arm, container, pads_height_m, side_gaps_m, refusals
            )
            if chosen is not None:
                found.append(chosen)
        if len(found) > len(best):
            best = found
        if len(best) == len(scheme):
            break
    return best, refusals


def _first_with_room(
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
            at = stance(candidate, along, yaw, gap, arm.description.gripper.stroke_m)
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
