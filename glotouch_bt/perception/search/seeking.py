"""Search for the next object: follow a policy until a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.moves import Move, MoveOutcome, SearchPlan
from glotouch_bt.perception.search.policies import SearchPolicy, Stretch
from glotouch_bt.perception.search.routes import Routes
from glotouch_bt.perception.touch import Contact
from glotouch_bt.robot import Array

MAX_HOPS = 12
"""Maximum number of hops per search to continue at another position."""
ENTRY_SPACING_M = 0.03
"""Minimum distance between positions tried for lowering the ball."""
RETREAT_M = 0.005
"""Retreat from a contact. Source: paper III-A."""
OBSTACLE_M = 0.012
"""Radius of the exclusion at a contact with a traced object."""
HINT_BEFORE_M = 0.015
"""Distance before a hint's contact at which its approach starts."""
HINT_PAST_M = 0.006
"""Distance past a hint's contact at which its approach ends."""
BESIDE_M = (0.025, 0.040, 0.055, 0.070)
"""Distances from a contact from above at which the ball is lowered beside the object."""
BESIDE_DIRECTIONS = 8
"""Number of directions in which the ball is lowered beside the object."""


@dataclass(frozen=True)
class Sought:
    """Result of the search for the next object.

    Attributes:
        belief: The updated map.
        contact: Side contact with a new object; None if nothing is left to explore or to reach, or if hardly anything
            of an unknown number can be left.
        lowered: The ball is at sensing height.
        tip_K_m: (2,) position of the ball.
    """

    belief: SearchMap
    contact: Contact | None
    lowered: bool
    tip_K_m: Array


def seek(
    belief: SearchMap, policy: SearchPolicy, tip_K_m: Array, *, lowered: bool, enough: float = 0.0
) -> SearchPlan[Sought]:
    """Follow the policy until a side contact with a new object, then retreat from it.

    Travelled paths at sensing height become free space. A refused move drops its frontier, and so does a sweep that
    ends without a contact and without any new position. A contact with a traced object drops its position, and the
    search continues.

    Args:
        belief: Map before the search.
        policy: Policy for the next sweep.
        tip_K_m: (2,) position of the ball.
        lowered: The ball is at sensing height.
        enough: Share of the places left below which the search for a known number ends.
    """
    tip, hops, cornered = np.asarray(tip_K_m, dtype=np.float64)[:2], 0, False
    while (belief.hints and (lowered or not belief.complete)) or not (belief.complete or belief.is_searched(enough)):
        if belief.hints:
            hint, belief = belief.hints[0], belief.with_hints(belief.hints[1:])
            belief, contact, tip, lowered = yield from _follow(belief, hint, tip, lowered=lowered)
            if contact is not None:
                outcome = yield Move("retreat", tip - RETREAT_M * contact.approach_K[:2])
                return Sought(belief.with_path(outcome.path_K_m), contact, True, outcome.tip_K_m)
            continue
        before, stretch = belief, policy.next_stretch(belief, tip)
        if stretch is not None and (cornered or not lowered) and not stretch.raised:
            stretch = None
        if stretch is None:
            spot = _way_in(policy, belief, tip, lowered=lowered) if hops < MAX_HOPS else None
            if spot is None:
                return Sought(belief, None, lowered, tip)
            hops += 1
            stretch, cornered = Stretch(spot[None, :], raised=True), False
        for waypoint, goal in zip((*stretch.waypoints_K_m, *stretch.further_K_m), stretch.goals_K_m, strict=True):
            beside = bool(belief.inside_exclusion(tip[None])[0])
            outcome = yield Move("hop" if stretch.raised else "sweep", waypoint)
            tip, belief = outcome.tip_K_m, belief.with_path(outcome.path_K_m)
            if outcome.refused:
                belief = belief.with_dropped(goal)
                break
            if stretch.raised:
                lowered = outcome.contact is None
            if outcome.contact is None:
                continue
            if belief.knows(outcome.contact):
                belief = belief.with_dropped(outcome.contact.tip_K_m)
                belief = belief.with_obstacle(outcome.contact.point_K_m, OBSTACLE_M)
                if not stretch.raised:
                    cornered = beside  # enclosed by protruding parts: sweeps cannot leave, hop instead
                    tip = (yield Move("retreat", tip - RETREAT_M * outcome.contact.approach_K[:2])).tip_K_m
                break
            place = outcome.contact.tip_K_m
            side: Contact | None = outcome.contact
            if stretch.raised:
                belief, side, tip, lowered = yield from _from_its_side(belief, outcome)
            if side is not None:
                outcome = yield Move("retreat", tip - RETREAT_M * side.approach_K[:2])
                tip, belief = outcome.tip_K_m, belief.with_path(outcome.path_K_m)
                if not belief.knows(side):
                    return Sought(belief, side, True, tip)
            belief = belief.with_dropped(place)
            break
        else:
            if not stretch.raised and not belief.reaches_beyond(before):  # go on elsewhere, not here for ever
                belief, cornered = belief.with_dropped(stretch.waypoints_K_m[-1]), True
    return Sought(belief, None, lowered, tip)


def _follow(
    belief: SearchMap, hint: Contact, tip: Array, *, lowered: bool
) -> SearchPlan[tuple[SearchMap, Contact | None, Array, bool]]:
    """Go to the position of a hint and touch it again; a raised ball is lowered beside it.

    Returns:
        Map, contact or None, position of the ball, and True if it is at sensing height.
    """
    against = hint.reaction_K[:2] / max(float(np.linalg.norm(hint.reaction_K[:2])), 1e-9)
    before = hint.tip_K_m[:2] + HINT_BEFORE_M * against
    past = hint.tip_K_m[:2] - HINT_PAST_M * against
    if belief.knows(hint) or not bool(belief.inside_extent(before[None])[0]):
        return belief, None, tip, lowered
    way = Routes(belief, tip).to(before) if lowered else ()
    if way is None:
        return belief, None, tip, lowered
    if not lowered:
        outcome = yield Move("hop", before)
        tip, belief = outcome.tip_K_m, belief.with_path(outcome.path_K_m)
        if outcome.refused or outcome.contact is not None:
            return belief, None, tip, False
    for waypoint in (*way, past):
        outcome = yield Move("sweep", waypoint)
        tip, belief = outcome.tip_K_m, belief.with_path(outcome.path_K_m)
        if outcome.refused or outcome.contact is not None:
            break
    if outcome.contact is None or belief.knows(outcome.contact):
        return belief, None, tip, True
    return belief, outcome.contact, tip, True


def _from_its_side(belief: SearchMap, landed: MoveOutcome) -> SearchPlan[tuple[SearchMap, Contact | None, Array, bool]]:
    """After a contact from above, lower the ball beside the object and touch its side.

    Returns:
        Map, side contact or None, position of the ball, and True if it is at sensing height.
    """
    middle, tip, lowered = np.asarray(landed.tip_K_m), landed.tip_K_m, False
    angles = np.linspace(0, 2 * np.pi, BESIDE_DIRECTIONS, endpoint=False)
    towards_centre = np.arctan2(-middle[1], -middle[0])
    angles = angles[np.argsort(np.abs((angles - towards_centre + np.pi) % (2 * np.pi) - np.pi), kind="stable")]
    for distance in BESIDE_M:
        for angle in angles:
            place = middle + distance * np.array([np.cos(angle), np.sin(angle)])
            if not belief.inside_extent(place[None])[0] or belief.inside_exclusion(place[None])[0]:
                continue
            outcome = yield Move("hop", place)
            belief, tip, lowered = belief.with_path(outcome.path_K_m), outcome.tip_K_m, outcome.contact is None
            if outcome.refused or outcome.contact is not None:
                break  # continue at the next distance
            outcome = yield Move("probe", middle)
            belief, tip = belief.with_path(outcome.path_K_m), outcome.tip_K_m
            if outcome.contact is not None:
                return belief, outcome.contact, tip, True
            return belief, None, tip, True  # the object is gone
    return belief, None, tip, lowered


def _way_in(policy: SearchPolicy, belief: SearchMap, tip_xy: Array, *, lowered: bool) -> Array | None:
    """Return where to lower the ball: the nearest position from which the policy can continue.

    Before the first sweep it is the current position. Then it is a free position of the path, or, if none will do, one
    that was not visited yet: what was found encloses the path. There may be an object, which is then touched from
    above.
    """
    half = np.asarray(belief.half_extent_m)
    inside = np.clip(tip_xy, -half, half)
    if len(belief.path_K_m) == 0:
        return None if lowered or len(belief.dropped) else inside
    axes = (np.linspace(-h, h, 2 + round(2 * h / ENTRY_SPACING_M)) for h in half)
    anywhere = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    for places in (belief.path_K_m, anywhere):
        free = places[~belief.inside_exclusion(places) & ~belief.is_dropped(places)]
        free = free[np.argsort(np.linalg.norm(free - inside, axis=1), kind="stable")]
        tried = np.zeros((0, 2))
        for spot in free:
            if len(tried) and np.linalg.norm(tried - spot, axis=1).min() < ENTRY_SPACING_M:
                continue
            if policy.next_stretch(belief, spot) is not None:
                return np.asarray(spot)
            tried = np.vstack([tried, spot])
    return None
