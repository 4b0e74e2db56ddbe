"""Space for closures: the stance at which the open hand fits beside a candidate, and candidates that lack space."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from glotouch_bt.motion import hand_pose_B
from glotouch_bt.perception import recognition
from glotouch_bt.perception.touch.outline import footprint
from glotouch_bt.robot import MotionRefused
from glotouch_bt.skill import Context
from glotouch_skills.common.hand import CLEARANCE_M, NoSpace, keeping_clear_of, neighbours, require_clear
from glotouch_skills.common.planning import (
    ClosureParams,
    Neighbour,
    Option,
    Stance,
    beside,
    finger_clearance_m,
    side_gaps_m,
)

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import Belief

MIN_PROBABILITY = 0.05
"""Least probability of a candidate for which objects are moved: that takes half a minute each. Source: ours."""


def fitting_stance(context: Context, belief: Belief, option: Option, side_gap_m: float) -> Stance:
    """Return the option's stance, opened as far as fits beside the neighbours, or a stance close to it.

    Args:
        context: The arm and its world.
        belief: What is known; its candidates are kept clear of.
        option: The closure.
        side_gap_m: Preferred gap between open jaw and candidate on each side.

    Raises:
        NoSpace: The hand does not fit beside candidates and walls.
        MotionRefused: The hand does not fit.
    """
    arm, closure = context.arm, option.closure
    gripper, gaps_m = arm.description.gripper, side_gaps_m(side_gap_m)
    (touchset,) = (t for t in belief.touchsets if t.candidate.index == closure.candidate)
    opened = [option.at.opened(gap, gripper) for gap in gaps_m]
    near = neighbours((t.candidate for t in belief.touchsets), closure.candidate)
    around = [Neighbour.within(c.index, footprint(c, presumed=False)) for c in near]
    half_extent_m = 0.5 * np.array(context.world.container.interior_m[:2])
    refusals: list[MotionRefused] = []
    with keeping_clear_of(arm, near):
        for at in (*opened, *beside(touchset, option.at, gripper, gaps_m[-1])):
            if refusals and finger_clearance_m(at, around, half_extent_m, gripper) < CLEARANCE_M:
                continue  # much quicker than the whole hand at its place, which gives the first refusal
            place = np.array([*at.position_K_m, closure.height_m])
            pose = hand_pose_B(arm, context.world.container, place, at.yaw_K_rad)
            try:
                require_clear(arm, pose, at.opening_m, CLEARANCE_M)
            except MotionRefused as refusal:
                refusals.append(refusal)
                continue
            return at
    raise refusals[0]


def lacking_space(
    context: Context,
    belief: Belief,
    refused: Iterable[Option],
    p: ClosureParams,
    min_gain_nats: float,
    wanted: set[int],
) -> tuple[int, ...]:
    """Return the candidates with closures that are worth making and lack only space, most probable first.

    Args:
        context: The arm and its world.
        belief: What is known.
        refused: Closures that could not be made.
        p: Parameters of the closures.
        min_gain_nats: Expected gain of a closure that is worth making.
        wanted: Candidates whose closures are worth making whatever the gain.
    """
    probable = {m.index for m in belief.ranking.matches if m.probability >= MIN_PROBABILITY}
    found = [option for option in refused if option.closure.candidate in probable]
    if not found:
        return ()
    cramped = set()
    for option, gain in zip(found, recognition.expected_gain(belief, [o.closure for o in found]), strict=True):
        index = option.closure.candidate
        if index in cramped or (index not in wanted and gain < min_gain_nats):
            continue
        try:
            fitting_stance(context, belief, option, p.side_gap_m)
        except NoSpace:
            cramped.add(index)
        except MotionRefused:
            continue
    return tuple(m.index for m in belief.ranking.matches if m.index in cramped)
