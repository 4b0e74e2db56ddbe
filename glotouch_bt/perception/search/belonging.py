"""Assignment of contacts and traces to candidates."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.search.bodies import SEPARATE_NATS, outline_of
from glotouch_bt.perception.search.map import Mask
from glotouch_bt.perception.search.tracing import OutlineTrace, TraceParams
from glotouch_bt.perception.touch import Candidate, Contact, contour_quality, signed_distance
from glotouch_bt.perception.touch.outline import KNOWN_QUALITY, convex_hull, envelope, polygon_distance
from glotouch_bt.robot import Array

TRACE = TraceParams()
"""Parameters of a trace: a contact belongs to a candidate at the same distances and odds as to a trace."""
PART_M = 0.030
"""Maximum distance from a candidate's envelope at which a contact is tested for belonging to it."""
FLAT_M = 1e-4
"""Width across their line below which contacts count as collinear."""
WELL_TRACED_QUALITY = 0.5
"""Minimum `contour_quality` of a candidate that is traced on all sides."""
FULLY_TRACED_QUALITY = 0.75
"""Minimum `quality` of a candidate that is traced on all sides; the centre's standard deviation is then below 3 mm.
Source: ours."""
PROTRUSION_M = 0.012
"""Maximum distance, from the envelope of a fully traced candidate, of a contact with a part that protrudes from it.
Source: ours; the ball's diameter."""
ON_M = 0.004
"""Maximum distance from such a candidate's envelope at which a contact belongs to it."""
MAX_LENGTH_M = 0.125
"""Maximum length of a candidate after a merge."""


def part_of(known: tuple[Candidate, ...], first: Contact, radius_m: float) -> Candidate | None:
    """Return the candidate of a new contact: by distance, or if one object explains both better than two; else None."""
    for old in sorted(known, key=lambda c: float(signed_distance(envelope(c), first.point_K_m[None])[0])):
        if float(signed_distance(envelope(old), first.point_K_m[None])[0]) > PART_M:
            return None
        off = first.tip_K_m[:2] - old.contour.centre_K_m
        if float(first.reaction_K[:2] @ off) < TRACE.facing * float(np.hypot(off[0], off[1])):
            continue
        if overlaps(old, first.point_K_m[None]):
            return old
        one = outline_of((*old.contacts, first), radius_m)
        two = outline_of(old.contacts, radius_m).log_evidence + outline_of((first,), radius_m).log_evidence
        if one.log_evidence > two + np.log(TRACE.other) and max(one.contour.size_m) <= TRACE.largest_m:
            return old
    return None


def joins(known: tuple[Candidate, ...], contacts: tuple[Contact, ...], radius_m: float) -> bool:
    """Return True if the contacts of a trace under way belong to an existing candidate."""
    points = np.array([c.point_K_m for c in contacts])
    near = (old for old in known if overlaps(old, points))
    return any(max(outline_of((*old.contacts, *contacts), radius_m).contour.size_m) <= MAX_LENGTH_M for old in near)


def of_another(known: tuple[Candidate, ...], radius_m: float, contacts: tuple[Contact, ...], contact: Contact) -> bool:
    """Return True if a new contact of a trace belongs to another candidate, which is near and explains it better.

    A candidate with an uncertain centre does not count: it may be a part of the traced object.

    Args:
        known: The other candidates.
        radius_m: Radius of the ball; 0 for another section.
        contacts: Contacts of the trace.
        contact: The new one.
    """

    def gain(of: tuple[Contact, ...]) -> float:
        return outline_of((*of, contact), radius_m).log_evidence - outline_of(of, radius_m).log_evidence

    return any(
        c.quality >= KNOWN_QUALITY
        and float(signed_distance(envelope(c), contact.point_K_m[None])[0]) < PART_M
        and gain(c.contacts) - gain(contacts) > SEPARATE_NATS
        for c in known
    )


def taken_by(others: tuple[Candidate, ...], radius_m: float, places_K_m: Array) -> Mask:
    """Return (n,) True for places (n, 2) where a ball would overlap another candidate whose outline is known."""
    taken = np.zeros(len(places_K_m), dtype=np.bool_)
    for c in others:
        if c.quality >= KNOWN_QUALITY:
            taken |= signed_distance(envelope(c), places_K_m) < radius_m
    return taken


def _is_well_traced(candidate: Candidate) -> bool:
    tips = np.array([c.tip_K_m[:2] for c in candidate.contacts])
    return contour_quality(tips, candidate.contour) >= WELL_TRACED_QUALITY


def is_fully_traced(candidate: Candidate) -> bool:
    """Return True if the outline is known on all sides, so that what lies outside it is something else.

    The end of something long has contacts on all sides, too, but its centre is uncertain.
    """
    return candidate.quality >= FULLY_TRACED_QUALITY and _is_well_traced(candidate)


def overlaps(old: Candidate, points: Array) -> bool:
    """Return True if contact points (n, 2) are near enough to a candidate to be the same object."""
    outside_m = signed_distance(envelope(old), points)
    if is_fully_traced(old):
        return float(np.median(outside_m)) <= ON_M
    return float(outside_m.min()) <= TRACE.own_m or _apart_m(old.contacts, points) <= TRACE.between_m


def lies_over(old: Candidate, traced: OutlineTrace) -> bool:
    """Return True if a whole trace lies over or close to a candidate: it was pushed, or a part protrudes from it.

    A trace round a neighbour has contacts on its far side.
    """
    points = np.array([c.point_K_m for c in traced.contacts])
    if float(signed_distance(envelope(old), points).max()) <= PROTRUSION_M:
        return True
    if traced.outline is None:
        return False
    return float(signed_distance(envelope(old), traced.outline.contour.centre_K_m[None])[0]) <= 0.0


def _apart_m(contacts: tuple[Contact, ...], points: Array) -> float:
    """Return the distance of points (n, 2) from the hull of the contact points; not positive if one is inside."""
    hull = np.array([c.point_K_m for c in contacts])
    if np.linalg.svd(hull - hull.mean(axis=0))[1][1] > FLAT_M:
        return float(polygon_distance(convex_hull(hull), points).min())
    return float(np.linalg.norm(points[:, None] - hull[None], axis=2).min())
