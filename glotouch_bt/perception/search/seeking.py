"""From one object to the next: follow a policy until something is touched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.moves import Felt, Move, Plan
from glotouch_bt.perception.search.policies import SearchPolicy, Stretch
from glotouch_bt.perception.search.routes import Routes
from glotouch_bt.perception.touch import Contact
from glotouch_bt.robot import Array

MAX_HOPS = 12
"""Most changes of place by lifting the ball because no way leads on, per search."""
WAYS_IN_APART_M = 0.03
RETREAT_M = 0.005
"""Way back from a contact (paper III-A)."""
OBSTACLE_M = 0.012
"""What was touched where nothing new can be is kept clear of by this much from the contact point."""
HINT_BEFORE_M, HINT_PAST_M = 0.015, 0.006
"""A hint is approached from so far before the contact it was, and looked for so far past it."""
TAKEN_M = 0.004
"""A place this near a dropped one is not tried for coming down."""
BESIDE_M = (0.025, 0.040, 0.055, 0.070)
"""Distances from where the ball landed on something at which it is lowered beside it."""
BESIDE_DIRECTIONS = 8


@dataclass(frozen=True)
class Sought:
    """How a search for the next object ended.

    Attributes:
        belief: What is known now.
        contact: The side contact that ended it, or None: nothing is left to explore, or to reach.
        lowered: The ball is at sensing height.
    """

    belief: SearchMap
    contact: Contact | None
    lowered: bool


def seek(belief: SearchMap, policy: SearchPolicy, tip_K_m: Array, *, lowered: bool) -> Plan[Sought]:
    """Sweep, or descend, as the policy says until an object that is not traced yet is touched from the side; the ball
    has retreated from it.

    Every stretch of way that was gone at sensing height becomes evidence; a way that is refused drops its frontier; a
    contact within a traced object's envelope drops its place, and the search goes on.

    Args:
        belief: What is known so far.
        policy: Where to go next.
        tip_K_m: (2,) where the ball is.
        lowered: It is at sensing height.
    """
    tip, hops, cornered = np.asarray(tip_K_m, dtype=np.float64)[:2], 0, False
    while lowered and belief.hints:
        hint, belief = belief.hints[0], belief.with_hints(belief.hints[1:])
        belief, contact, tip = yield from _follow(belief, hint, tip)
        if contact is not None:
            felt = yield Move("retreat", tip - RETREAT_M * contact.approach_K[:2])
            return Sought(belief.with_path(felt.path_K_m), contact, True)
    while True:
        stretch = policy.next_stretch(belief, tip)
        if stretch is not None and (cornered or not lowered) and not stretch.raised:
            stretch = None
        if stretch is None:
            spot = _way_in(policy, belief, tip, lowered=lowered) if hops < MAX_HOPS else None
            if spot is None:
                return Sought(belief, None, lowered)
            hops += 1
            stretch, cornered = Stretch(spot[None, :], raised=True), False
        for waypoint in stretch.waypoints_K_m:
            beside = bool(belief.inside_exclusion(tip[None])[0])
            felt = yield Move("hop" if stretch.raised else "sweep", waypoint)
            tip, belief = felt.tip_K_m, belief.with_path(felt.path_K_m)
            if felt.refused:
                belief = belief.with_dropped(stretch.waypoints_K_m[-1])
                break
            if stretch.raised:
                lowered = felt.contact is None
            if felt.contact is None:
                continue
            if belief.knows(felt.contact):
                belief = belief.with_dropped(felt.contact.tip_K_m)
                belief = belief.with_obstacle(felt.contact.point_K_m, OBSTACLE_M)
                if not stretch.raised:
                    cornered = beside  # no sweep leads out from between its limbs
                    tip = (yield Move("retreat", tip - RETREAT_M * felt.contact.approach_K[:2])).tip_K_m
                break
            place = felt.contact.tip_K_m
            side: Contact | None = felt.contact
            if stretch.raised:
                belief, side, tip, lowered = yield from _from_its_side(belief, felt)
            if side is not None:
                felt = yield Move("retreat", tip - RETREAT_M * side.approach_K[:2])
                return Sought(belief.with_path(felt.path_K_m), side, True)
            belief = belief.with_dropped(place)
            break


def _follow(belief: SearchMap, hint: Contact, tip: Array) -> Plan[tuple[SearchMap, Contact | None, Array]]:
    """To where something was touched by the way, and touch it again. Map, contact or None, where the ball is."""
    against = hint.reaction_K[:2] / max(float(np.linalg.norm(hint.reaction_K[:2])), 1e-9)
    before = hint.tip_K_m[:2] + HINT_BEFORE_M * against
    past = hint.tip_K_m[:2] - HINT_PAST_M * against
    if belief.knows(hint) or not bool(belief.inside_extent(before[None])[0]):
        return belief, None, tip
    way = Routes(belief, tip).to(before)
    if way is None:
        return belief, None, tip
    for waypoint in (*way, past):
        felt = yield Move("sweep", waypoint)
        tip, belief = felt.tip_K_m, belief.with_path(felt.path_K_m)
        if felt.refused or felt.contact is not None:
            break
    if felt.contact is None or belief.knows(felt.contact):
        return belief, None, tip
    return belief, felt.contact, tip


def _from_its_side(belief: SearchMap, landed: Felt) -> Plan[tuple[SearchMap, Contact | None, Array, bool]]:
    """The ball stands on something: come down beside it, as near as is free, and touch its side.

    Returns:
        Map, the side contact or None, where the ball is, and whether it is at sensing height.
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
            felt = yield Move("hop", place)
            belief, tip, lowered = belief.with_path(felt.path_K_m), felt.tip_K_m, felt.contact is None
            if felt.refused or felt.contact is not None:
                break  # farther out, rather than all round at this distance
            felt = yield Move("probe", middle)
            belief, tip = belief.with_path(felt.path_K_m), felt.tip_K_m
            if felt.contact is not None:
                return belief, felt.contact, tip, True
            return belief, None, tip, True  # it has gone
    return belief, None, tip, lowered


def _way_in(policy: SearchPolicy, belief: SearchMap, tip_xy: Array, *, lowered: bool) -> Array | None:
    """Where to lower the ball: the nearest place it has been from which something unexplored can be reached.

    Where it has been is free, unless an object was traced there since. Before the first sweep it is where it hangs.
    """
    half = np.asarray(belief.half_extent_m)
    inside = np.clip(tip_xy, -half, half)
    if len(belief.path_K_m) == 0:
        return None if lowered or len(belief.dropped) else inside
    free = belief.path_K_m[~belief.inside_exclusion(belief.path_K_m)]
    free = free[np.argsort(np.linalg.norm(free - inside, axis=1), kind="stable")]
    tried = np.zeros((0, 2))
    for spot in free:
        if len(tried) and np.linalg.norm(tried - spot, axis=1).min() < WAYS_IN_APART_M:
            continue
        if len(belief.dropped) and np.linalg.norm(belief.dropped - spot, axis=1).min() < TAKEN_M:
            continue
        if policy.next_stretch(belief, spot) is not None:
            return np.asarray(spot)
        tried = np.vstack([tried, spot])
    return None
