"""Candidates that may be two bodies although one outline explains their contacts, and a probe that tells.

As many candidates are traced as objects are known, but two of them are probably one body. Then an object is missing.
It may be hidden elsewhere, or it may be a part of a third candidate: contacts of two bodies that touch can fit one
outline. Where their borders would meet, the ball gets deeper than that outline allows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.perception.search.bodies import SEPARATE_NATS, division, doubts
from glotouch_bt.perception.search.map import MISSED_BELOW, SearchMap
from glotouch_bt.perception.search.moves import Move, SearchPlan
from glotouch_bt.perception.search.seeking import RETREAT_M, Sought
from glotouch_bt.perception.touch import Candidate, Contact, signed_distance
from glotouch_bt.robot import Array

TWO_BODIES = {"intercept": -3.9, "per_nat": 0.29}
"""Log odds that a candidate is two bodies, before their number is considered, and what each nat gained by its best
division adds. Source: the counts of `SEPARATE_NATS`, and 21 layouts in which objects were missed (planar, seeds
61844-61892 of touching_five)."""
MIN_LOG_ODDS = -2.0
"""Minimum log odds that a candidate is two bodies for it to be probed. With a lower limit more single objects are
probed, which takes travel and changes outlines that were right. Source: of 29 searches of touching_five that had ended
(planar, seeds 55400-55425, 55427, 55435 and 55438), 4 had such a candidate, and all 4 lacked an object."""
CLEAR_M = 0.008
"""Distance of the ball from the outline where a probe starts. Source: ours."""
FARTHEST_M = 0.15
"""Maximum distance of such a start from the outline's centre. Source: ours; larger than any object."""
SHORT_OF_M = 0.004
"""Distance before the outline's centre at which a probe ends. Source: ours."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """A candidate that may be two bodies, and probes to where their borders would meet.

    Attributes:
        index: Index of the candidate.
        probes_K_m: (n, 2, 2) start and goal of the ball's centre for each probe, the most telling one first.
    """

    index: int
    probes_K_m: Array


def next_suspect(belief: SearchMap, candidates: tuple[Candidate, ...], radius_m: float) -> Suspect | None:
    """Return the candidate that is most probably two bodies and worth a probe; None without one.

    By Bayes' rule: a third candidate is two bodies if two others are one, so its odds are those of `TWO_BODIES` times
    those of the likeliest such pair. None if the number of objects is unknown, or not in doubt.

    Args:
        belief: The map.
        candidates: All candidates.
        radius_m: Radius of the ball; 0 for another section, whose contacts do not tell bodies apart.
    """
    if radius_m == 0.0 or not belief.unprobed:
        return None
    found = doubts(candidates, radius_m, belief.path_K_m)
    best, likeliest = None, MIN_LOG_ODDS
    for candidate in candidates:
        pair = max((d.chance for d in found if all(candidate is not c for c in d.pair)), default=0.0)
        if pair < MISSED_BELOW or candidate.index in belief.probed:
            continue
        gain, parts = division(candidate.contacts, radius_m, belief.path_K_m)
        odds = float(scipy.special.logit(pair)) + TWO_BODIES["intercept"]
        odds += TWO_BODIES["per_nat"] * min(gain, SEPARATE_NATS)
        if len(parts) > 1 and odds > likeliest:
            likeliest, best = odds, Suspect(candidate.index, _probes(candidate, parts[0], radius_m))
    return best


def _probes(candidate: Candidate, part: tuple[Contact, ...], radius_m: float) -> Array:
    """Return probes (n, 2, 2) between neighbouring contacts of different parts, through the widest gap first."""
    centre = candidate.contour.centre_K_m
    off = np.array([c.point_K_m for c in candidate.contacts]) - centre
    bearing = np.arctan2(off[:, 1], off[:, 0])
    mine = np.array([any(c is p for p in part) for c in candidate.contacts])
    order = np.argsort(bearing, kind="stable")
    after = np.roll(order, -1)
    gap = (bearing[after] - bearing[order]) % (2 * np.pi)
    borders = np.flatnonzero(mine[order] != mine[after])
    borders = borders[np.argsort(-gap[borders], kind="stable")]
    away = np.arange(0.0, FARTHEST_M, 0.001)
    probes = []
    for angle in bearing[order[borders]] + 0.5 * gap[borders]:
        outwards = np.array([np.cos(angle), np.sin(angle)])
        distance = signed_distance(candidate.contour, centre + away[:, None] * outwards)
        start = away[distance < radius_m + CLEAR_M].max(initial=0.0)
        probes.append((centre + start * outwards, centre + min(SHORT_OF_M, start) * outwards))
    return np.array(probes).reshape(-1, 2, 2)


def feel_suspect(belief: SearchMap, suspect: Suspect, tip_K_m: Array, *, lowered: bool) -> SearchPlan[Sought]:
    """Probe a suspect from its side, the first way that is free; retreat from the contact.

    Args:
        belief: The map.
        suspect: The candidate.
        tip_K_m: (2,) position of the ball.
        lowered: The ball is at sensing height.
    """
    for start, goal in suspect.probes_K_m:
        if not belief.inside_extent(start[None])[0]:
            continue
        outcome = yield Move("hop", start)
        belief, tip_K_m, lowered = belief.with_path(outcome.path_K_m), outcome.tip_K_m, outcome.contact is None
        if outcome.refused or outcome.contact is not None:
            continue
        outcome = yield Move("probe", goal)
        belief, tip_K_m, contact = belief.with_path(outcome.path_K_m), outcome.tip_K_m, outcome.contact
        if contact is not None:
            outcome = yield Move("retreat", tip_K_m - RETREAT_M * contact.approach_K[:2])
            return Sought(belief.with_path(outcome.path_K_m), contact, True, outcome.tip_K_m)
    return Sought(belief, None, lowered, tip_K_m)
