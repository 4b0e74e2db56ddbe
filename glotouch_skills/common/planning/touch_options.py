"""Options of adaptive touching: the closures that could be made next, and the time of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import FeltSpace
from glotouch_bt.perception.recognition import Closure
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import Array, Gripper, Pose
from glotouch_skills.common.hand import descent_speed_steps, inner_edges, seconds_at
from glotouch_skills.common.planning.squeeze_motion import FAST_RISE_RATIO, ClosureParams, layer_heights
from glotouch_skills.common.planning.squeeze_plan import Stance, schemes, stance

YAWS_RAD = np.deg2rad(np.arange(0.0, 180.0, 30.0))
"""Jaw yaws over a candidate without tracks; half a turn suffices for parallel jaws."""
BESIDE_RAD = np.deg2rad([0.0, 5.0, -5.0, 10.0, -10.0])
"""Turns from a stance that are tried where the hand does not fit. Source: ours; up to a third of the step
of `YAWS_RAD`."""
BESIDE_M = (0.0, 0.008, -0.008, 0.016, -0.016)
"""Displacements along x_P that are tried with them. Source: ours; half the width of a pad, and all of it."""
SAME_M = 0.004
"""A closure within this distance of an earlier one gives no new information ..."""
SAME_RAD = np.deg2rad(8.0)
"""... if its yaw is also within this."""
CLOSURE_S = 1.6
"""Robot time of closing and opening once."""
TURN_S = 1.5
"""Robot time of turning the hand over a candidate."""
STOP_S = 0.6
"""Robot time of each start and stop."""


@dataclass(frozen=True)
class Option:
    """One closure that could be made next.

    Attributes:
        at: Stance of the open hand.
        closure: The closure.
        seconds: Robot time from now until it is done.
        after: Closures that the same stance then allows, `more_s` each.
        more_s: Robot time of one of `after`.
        instead_of: The planned stance if `at` is one close to it, where the hand fits; None: `at` is the planned one.
    """

    at: Stance
    closure: Closure
    seconds: float
    after: tuple[Closure, ...] = ()
    more_s: float = CLOSURE_S
    instead_of: Stance | None = None


@dataclass(frozen=True)
class Standing:
    """The open hand, lowered beside a candidate.

    Attributes:
        candidate: Index.
        at: Its stance.
        height_m: Height of the pads.
    """

    candidate: int
    at: Stance
    height_m: float


def stances_over(candidate: Candidate, gripper: Gripper, side_gap_m: float) -> list[Stance]:
    """Return the stances to consider: half a circle of yaws and, for a box-like candidate, its tracks."""
    contour = candidate.contour
    places = [(0.0, float(contour.yaw_rad + y)) for y in YAWS_RAD]
    if contour.kind == "box":
        tracks, *_ = schemes(candidate, gripper)
        places += [alternatives[0] for alternatives in tracks if abs(alternatives[0][0]) > SAME_M]
    found = (stance(candidate, along, yaw, side_gap_m, gripper) for along, yaw in places)
    return [s for s in found if s is not None]


def beside(touchset: TouchSet, at: Stance, gripper: Gripper, side_gap_m: float) -> list[Stance]:
    """Return the stances close to `at` that were not used yet, to try where the hand does not fit at `at`.

    A shifted stance stays over the middle half of the candidate, so that the jaws do not push it out sideways.

    Args:
        touchset: Touches of the candidate so far.
        at: The stance.
        gripper: The robot's gripper.
        side_gap_m: Gap between open jaw and candidate on each side.
    """
    candidate, x = touchset.candidate, np.array([np.cos(at.yaw_K_rad), np.sin(at.yaw_K_rad)])
    along = float((at.position_K_m - candidate.contour.centre_K_m) @ x)
    quarter_m = 0.25 * float(np.ptp(candidate.span_m(at.yaw_K_rad)))
    shifts = [shift for shift in BESIDE_M if not shift or abs(along + shift) <= quarter_m]
    places = [(along + shift, float(at.yaw_K_rad + turn)) for shift in shifts for turn in BESIDE_RAD]
    found = (stance(candidate, along_m, yaw_rad, side_gap_m, gripper) for along_m, yaw_rad in places[1:])
    return [s for s in found if s is not None and not _used(touchset, s)]


def options(
    touchsets: Sequence[TouchSet],
    standing: Standing | None,
    hand_K_m: Array,
    felt: FeltSpace,
    gripper: Gripper,
    p: ClosureParams,
) -> list[Option]:
    """Return all closures that could come next and were not made yet.

    A new stance begins with its lowest closure, which centres the candidate where it cannot topple. Higher ones follow
    in ascending order, at any of the heights.

    Args:
        touchsets: Touches so far, one set a candidate.
        standing: Stance of the lowered open hand, or None if it is high.
        hand_K_m: (3,) pads' mid-point.
        felt: Where the probe and the fingers stood: there, the fingers come down faster.
        gripper: The robot's gripper.
        p: Parameters of the closures.
    """
    out: list[Option] = []
    for touchset in touchsets:
        candidate = touchset.candidate
        heights = layer_heights(candidate, gripper, p)
        here = standing if standing is not None and standing.candidate == candidate.index else None
        if here is not None:
            for z in heights[heights > here.height_m + SAME_M]:
                seconds = CLOSURE_S + STOP_S + (z - here.height_m) / (FAST_RISE_RATIO * p.descent_speed_m_s)
                out.append(Option(here.at, _closure(candidate, here.at, float(z)), float(seconds)))
        for at in stances_over(candidate, gripper, p.side_gap_m):
            if _used(touchset, at):
                continue
            lowest, *higher = (_closure(candidate, at, float(z)) for z in heights)
            seconds = _travel_s(candidate, at, float(heights[0]), hand_K_m, felt, gripper, p) + CLOSURE_S
            gap = float(np.ptp(heights)) / max(len(heights) - 1, 1)
            more = CLOSURE_S + STOP_S + gap / (FAST_RISE_RATIO * p.descent_speed_m_s)
            out.append(Option(at, lowest, seconds, tuple(higher), more))
    return out


def best_rates(options: Sequence[Option], gains: Sequence[Array]) -> Array:
    """Return the expected nats per second (n,) of each option, alone or with the best next closure of its stance.

    Args:
        options: The options.
        gains: For each, the gain of its closure, then of those in `after`.
    """
    rates = []
    for option, gain in zip(options, gains, strict=True):
        alone = gain[0] / option.seconds
        both = (gain[0] + max(gain[1:], default=0.0)) / (option.seconds + option.more_s)
        rates.append(max(alone, both) if len(gain) > 1 else alone)
    return np.array(rates)


def _closure(candidate: Candidate, at: Stance, height_m: float) -> Closure:
    return Closure(candidate.index, at.yaw_K_rad, height_m, at.position_K_m)


def _used(touchset: TouchSet, at: Stance) -> bool:
    """Return True if a sequence was taken at this stance or half a turn from it."""
    for s in touchset.sequences:
        turn = (s.yaw_rad - at.yaw_K_rad + 0.5 * np.pi) % np.pi - 0.5 * np.pi
        if abs(turn) < SAME_RAD and float(np.linalg.norm(s.position_K_m - at.position_K_m)) < SAME_M:
            return True
    return False


def _travel_s(
    candidate: Candidate,
    at: Stance,
    height_m: float,
    hand_K_m: Array,
    felt: FeltSpace,
    gripper: Gripper,
    p: ClosureParams,
) -> float:
    """Return the time of moving to the headroom, across, and down to `height_m` beside the candidate."""
    below = gripper.fingertip_below_P_m
    across = float(np.linalg.norm(at.position_K_m - hand_K_m[:2]))
    up = abs(p.headroom_m + below - float(hand_K_m[2]))
    edges = inner_edges(gripper, Pose.pointing_down(np.array([*at.position_K_m, height_m]), at.yaw_K_rad), at.opening_m)
    speed_steps = descent_speed_steps(felt, edges, p.headroom_m, candidate.height_m, p.descent_speed_m_s)
    down_s = seconds_at(speed_steps, p.headroom_m + below - height_m)
    return (up + across) / p.travel_speed_m_s + down_s + TURN_S + 4 * STOP_S
