"""Number of bodies behind contacts: one outline, or two or more that touch, decided by evidence.

Two convex bodies can be separated by a line, so every partition of the contacts by a line is a hypothesis. Its evidence
is the product of the marginal likelihoods of an outline for each part. No gap between the bodies is assumed.

The test needs contacts of a ball, whose scatter the outlines know. Contact points of another section (radius 0) are up
to 20 mm off: 8 of 8 completed traces of one square with the bare fingers became two or three bodies (bench contact,
realistic, seeds 53800-53804). They count as one body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.perception.search.map import Mask
from glotouch_bt.perception.touch import Candidate, Contact, signed_distance
from glotouch_bt.perception.touch.outline import (
    OutlineBelief,
    envelope,
    infer_outline,
    nearest_distance,
)
from glotouch_bt.robot import Array

SEPARATE_NATS = 12.0
"""Minimum gain of log evidence by which two bodies explain contacts better than one. Source: 54 of 77 contours of
several objects gain more, and 15 of 408 of one (planar, seeds 700-759)."""
WELL_NATS = 3.8
"""Log evidence of a contact above which one outline explains the contacts well. Source: at most 3.5 on the 69
contours of `SEPARATE_NATS`."""
MIN_BODY_M = 0.015
"""Minimum width of a body. A narrower part is a limb. Source: objects are at least 15 mm wide."""
MIN_PART = 2
"""Minimum number of contacts of a body."""
ONE_BODY = {"intercept": 5.2, "per_nat": -0.021, "per_mm_outside": -0.085, "per_mm_long": -0.0285}
"""Log odds that two neighbouring candidates are one body: the intercept, and what each nat of gain by two bodies, each
millimetre that the contacts of the less certain one lie outside the other's envelope (median), and each millimetre of
length of the one outline add. Source: logistic regression on 1325 pairs, of which 287 were one body, in searches that
had traced as many candidates as objects (planar, seeds 55400-55499 of touching_five, 55400-55439 of close_five and
55400-55424 of container_five)."""
GAIN_NATS = (-20.0, 120.0)
"""Limits of the gain that counts for `ONE_BODY`: beyond them, it says no more. Source: ours."""
OUTSIDE_M = (-0.020, 0.040)
"""The same for the distance of contacts from the other's envelope. Source: ours."""
LONGEST_M = 0.3
"""The same for the length of the one outline. Source: ours; more than twice any object."""
MIN_CHANCE = 0.01
"""Minimum probability that two neighbours are one body for a doubt. Source: ours."""
BESIDE_M = 0.020
"""Maximum distance between outlines that may be one body."""
MAX_NATS = 7.0
"""Log evidence of a contact that a further outline is assumed to reach at most. Source: ours; the upper quartile is
4.6."""
DIRECTIONS = 12
"""Number of directions in which contacts are divided."""
NEAR_M = 0.06
"""Maximum distance from the contacts of free positions that are evidence."""
MOVED_M = 0.006
"""Distance from a contact within which a free position is no evidence. Source: pushes of a few millimetres."""


def outline_of(contacts: tuple[Contact, ...], radius_m: float, free_K_m: Array | None = None) -> OutlineBelief:
    """Infer the outline of one body.

    Args:
        contacts: Its contacts, at its current position.
        radius_m: Radius of the ball; 0 for another section, whose contact points are fitted.
        free_K_m: (n, 2) positions of the ball without contact.
    """
    places = np.array([c.tip_K_m[:2] if radius_m > 0 else c.point_K_m for c in contacts])
    if free_K_m is not None and len(free_K_m):
        free_K_m = free_K_m[nearest_distance(free_K_m, places) > MOVED_M]
    return infer_outline(
        places,
        radius_m,
        approach_K=np.array([c.approach_K[:2] for c in contacts]),
        reaction_K=np.array([c.reaction_K[:2] for c in contacts]),
        free_K_m=free_K_m,
    )


def bodies(
    contacts: tuple[Contact, ...], radius_m: float, path_K_m: Array, gain: float = SEPARATE_NATS
) -> tuple[tuple[Contact, ...], ...]:
    """Return the contacts of each body, the body with most contacts first; one tuple if one body explains all.

    Args:
        contacts: All contacts, at the bodies' current positions.
        radius_m: Radius of the ball; 0 for another section, whose contacts are one body.
        path_K_m: (n, 2) path of the ball without contact.
        gain: Minimum gain of log evidence of a further body.
    """
    if radius_m == 0 or len(contacts) < 2 * MIN_PART:
        return (contacts,)
    parts = _divided(contacts, radius_m, _near(path_K_m, contacts), gain)
    return tuple(sorted(parts, key=len, reverse=True))


def division(
    contacts: tuple[Contact, ...], radius_m: float, path_K_m: Array
) -> tuple[float, tuple[tuple[Contact, ...], ...]]:
    """Return the gain of log evidence by the best division into two bodies, and their contacts.

    The gain is -inf, and the contacts are whole, if there is no such division. The arguments are those of `bodies`.
    """
    whole = -np.inf, (contacts,)
    if radius_m == 0 or len(contacts) < 2 * MIN_PART:
        return whole
    free = _near(path_K_m, contacts)
    evidence, parts = _best_cut(contacts, radius_m, free, -np.inf)
    return (evidence - outline_of(contacts, radius_m, free).log_evidence, tuple(parts)) if parts else whole


@dataclass(frozen=True)
class Doubt:
    """Two neighbours that may be one body, and the probability that they are."""

    pair: tuple[Candidate, Candidate]
    chance: float


def doubts(candidates: tuple[Candidate, ...], radius_m: float, path_K_m: Array) -> tuple[Doubt, ...]:
    """Return the neighbours that may be one body; none without a ball.

    Two neighbours may be one body if one outline of a usual length explains their contacts nearly as well as two, and
    if the contacts of one lie near the outline of the other (`ONE_BODY`).
    """
    if radius_m == 0:
        return ()
    pairs = ((a, b) for i, b in enumerate(candidates) for a in candidates[:i])
    return tuple(d for a, b in pairs if (d := _doubt(a, b, radius_m, path_K_m)) is not None)


def chance_of_fewer(found: tuple[Doubt, ...], surplus: int = 0) -> float:
    """Return the probability that more than `surplus` pairs are one body each, the pairs taken as independent.

    Then there are fewer bodies than candidates without the surplus.
    """
    number = np.ones(1)  # probability of each number of pairs
    for d in found:
        number = np.convolve(number, (1.0 - d.chance, d.chance))
    return float(number[surplus + 1 :].sum())


def distinct(candidates: tuple[Candidate, ...], preferred: frozenset[int] = frozenset()) -> tuple[Candidate, ...]:
    """Return the candidates without those that are the same body as another one.

    The preferred one of them is kept, or else the one of the better quality.

    Args:
        candidates: All candidates.
        preferred: Indices of candidates to keep.
    """
    kept: list[Candidate] = []
    for candidate in sorted(candidates, key=lambda c: (c.index not in preferred, -c.quality, c.index)):
        if not any(same_body(candidate, other) for other in kept):
            kept.append(candidate)
    return tuple(c for c in candidates if any(c is k for k in kept))


def same_body(a: Candidate, b: Candidate) -> bool:
    """Return True if the centre of each candidate lies inside the other's envelope.

    Two bodies cannot overlap by that much.
    """
    pairs = ((a, b), (b, a))
    return all(float(signed_distance(envelope(c), o.contour.centre_K_m[None])[0]) < 0.0 for c, o in pairs)


def _doubt(a: Candidate, b: Candidate, radius_m: float, path_K_m: Array) -> Doubt | None:
    """Return the doubt about two candidates that stand close; None if they are two bodies almost for certain."""
    if float(signed_distance(envelope(a), b.extent_K_m).min()) > BESIDE_M:
        return None
    known, other = sorted((a, b), key=lambda c: -c.quality)
    points = np.array([c.point_K_m for c in other.contacts])
    outside_m = float(np.median(signed_distance(envelope(known), points)))
    gain, length_m = compared(a, b, radius_m, path_K_m)
    odds = ONE_BODY["intercept"] + ONE_BODY["per_nat"] * float(np.clip(gain, *GAIN_NATS))
    odds += ONE_BODY["per_mm_outside"] * 1e3 * float(np.clip(outside_m, *OUTSIDE_M))
    odds += ONE_BODY["per_mm_long"] * 1e3 * min(length_m, LONGEST_M)
    chance = float(scipy.special.expit(odds))
    return Doubt((a, b), chance) if chance >= MIN_CHANCE else None


def compared(a: Candidate, b: Candidate, radius_m: float, path_K_m: Array) -> tuple[float, float]:
    """Return the gain of log evidence by two bodies over one, and the length of the one outline, m."""
    both = (*a.contacts, *b.contacts)
    free = _near(path_K_m, both)
    one = outline_of(both, radius_m, free)
    two = sum(outline_of(c.contacts, radius_m, free).log_evidence for c in (a, b))
    return two - one.log_evidence, max(one.contour.size_m)


def _near(path_K_m: Array, contacts: tuple[Contact, ...]) -> Array:
    """Return the path positions (n, 2) that may be evidence about the body of these contacts."""
    points = np.array([c.point_K_m for c in contacts])
    return path_K_m[nearest_distance(path_K_m, points) < NEAR_M] if len(path_K_m) else path_K_m


def _divided(contacts: tuple[Contact, ...], radius_m: float, free: Array, gain: float) -> list[tuple[Contact, ...]]:
    """Divide contacts in two while that gains evidence."""
    limit = outline_of(contacts, radius_m, free).log_evidence + gain
    if limit > WELL_NATS * len(contacts) + gain:
        return [contacts]
    _, best = _best_cut(contacts, radius_m, free, limit)
    return [body for side in best for body in _divided(side, radius_m, free, gain)] if best else [contacts]


def _best_cut(
    contacts: tuple[Contact, ...], radius_m: float, free: Array, limit: float
) -> tuple[float, list[tuple[Contact, ...]]]:
    """Return the division in two with the largest log evidence above a limit, and this evidence; else no contacts."""
    best: list[tuple[Contact, ...]] = []
    for part in line_partitions(np.array([c.point_K_m for c in contacts])):
        sides = [tuple(c for c, mine in zip(contacts, part == side, strict=True) if mine) for side in (True, False)]
        outlines = [outline_of(sides[0], radius_m, free)]
        if outlines[0].log_evidence + MAX_NATS * len(sides[1]) < limit:
            continue
        outlines.append(outline_of(sides[1], radius_m, free))
        evidence = sum(o.log_evidence for o in outlines)
        if evidence > limit and min(min(o.contour.size_m) for o in outlines) >= MIN_BODY_M:
            limit, best = evidence, sides
    return limit, best


def line_partitions(points: Array) -> list[Mask]:
    """Return the distinct partitions (n,) of points (n, 2) by lines, with at least MIN_PART points on each side."""
    found: dict[bytes, Mask] = {}
    for angle in np.arange(DIRECTIONS) * np.pi / DIRECTIONS:
        order = np.argsort(points @ [np.cos(angle), np.sin(angle)], kind="stable")
        for k in range(MIN_PART, len(points) - MIN_PART + 1):
            part = np.zeros(len(points), dtype=np.bool_)
            part[order[:k]] = True
            part ^= not part[0]
            found.setdefault(part.tobytes(), part)
    return list(found.values())
