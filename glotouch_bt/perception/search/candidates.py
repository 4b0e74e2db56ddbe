"""What a trace adds to what is known: a new object, or more of one that had been traced in part."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.search.map import FACING, SearchMap
from glotouch_bt.perception.search.tracing import Trace, TraceParams
from glotouch_bt.perception.touch import (
    Candidate,
    Contact,
    believe_outline,
    contour_quality,
    signed_distance,
    split_moved,
)
from glotouch_bt.perception.touch.outline import OutlineBelief, convex_hull, envelope, polygon_distance
from glotouch_bt.robot import Array

MIN_CONTACTS = 3
"""An outline fitted to fewer is a guess."""
SAME_M = 0.010
"""Contacts this near to the room a known object takes are its own: objects stand farther apart."""
BETWEEN_M = 0.018
"""Contacts this near to the hull of a known object's contacts are its own, whatever outline those gave: objects
stand 30 mm apart, and are pushed a few."""
PART_M = 0.030
"""A contact farther than this from the room a candidate takes is not looked at as a part of it."""
OTHER = 0.02
"""Odds, before it is looked at, that a contact so near to a candidate is with something else; where that stands is not
in its evidence."""
FLAT_M = 1e-4
"""Contacts no wider apart than this across their line have no hull."""
SURE, ON_M = 0.5, 0.004
"""A candidate touched so evenly from all sides, and explained so well, has as its own what is met this near to it."""
HALF_KNOWN_M = 0.005
"""Standard deviation of a centre whose candidate has quality 1/2."""
LARGEST_M = 0.125
"""Nothing that is looked for is longer; two things that touch are not made one beyond it."""


@dataclass(frozen=True)
class Admitted:
    """What is known after a trace.

    Attributes:
        belief: The map.
        candidates: All of them.
        index: Of the one that is new, or better known; None: the trace gave none.
    """

    belief: SearchMap
    candidates: tuple[Candidate, ...]
    index: int | None


def admit(
    belief: SearchMap,
    known: tuple[Candidate, ...],
    first: Contact,
    traced: Trace,
    height_m: float,
    exclusion_m: float,
    *,
    part_of: Candidate | None = None,
) -> Admitted:
    """Add a trace to the map and to the candidates.

    Its way is evidence, its outliers hints. With too few contacts for an outline the first one's place is dropped. A
    trace beside or over a known candidate is more of that one: both are fitted as one, and nothing is counted again.

    Args:
        belief: The map before.
        known: The candidates before.
        first: The contact that started the trace.
        traced: What it gave.
        height_m: Of the sensing plane: the object is at least so high.
        exclusion_m: Margin round it that the search keeps out of.
        part_of: The candidate whose contacts the trace was begun with.
    """
    belief = belief.with_path(traced.path_K_m).with_hints((*belief.hints, *traced.outliers))
    if traced.outline is None or len(traced.contacts) < MIN_CONTACTS:
        return Admitted(belief.with_dropped(first.point_K_m), known, None)
    radius = traced.outline.touches.radius_m
    if part_of is not None and traced.continued:
        better = _with(part_of, traced.contacts, traced.outline)
        belief = belief.with_exclusion(envelope(better), exclusion_m, new=False)
        return Admitted(belief, tuple(better if c.index == better.index else c for c in known), better.index)
    for old in known:
        more = _merged(old, traced, radius, height_m)
        if more is not None:
            belief = belief.with_exclusion(envelope(more), exclusion_m, new=False)
            return Admitted(belief, tuple(more if c.index == old.index else c for c in known), old.index)
    candidate = Candidate(len(known), traced.outline.contour, height_m, quality(traced.outline), traced.contacts)
    return Admitted(belief.with_exclusion(envelope(candidate), exclusion_m), (*known, candidate), candidate.index)


def refined(before: Candidate, traced: Trace) -> Candidate | None:
    """The candidate with what tracing it on gave; None if that was nothing."""
    if traced.outline is None or len(traced.contacts) == len(before.contacts):
        return None
    return _with(before, traced.contacts, traced.outline)


def elsewhere_m(before: Candidate, after: Candidate) -> float:
    """How far off a candidate stands that has no place in common with what it was; 0 if it may be the same object.

    The circles round both outlines do not meet: a trace that lost one object among its neighbours has found another.
    """
    apart = float(np.linalg.norm(after.contour.centre_K_m - before.contour.centre_K_m))
    reach = 0.5 * (float(np.hypot(*before.contour.size_m)) + float(np.hypot(*after.contour.size_m)))
    return apart if apart > reach else 0.0


def quality(outline: OutlineBelief) -> float:
    """0..1: 1 / (1 + (sd / 5 mm)^2) of the standard deviation of the object's middle, x and y together.

    A rule of thumb for how evenly it was touched would not do: from the middle of an outline that takes the near end of
    a long thing for all of it, the contacts are all round.
    """
    return 1.0 / (1.0 + (float(np.hypot(*outline.centre_sd_m)) / HALF_KNOWN_M) ** 2)


def _with(candidate: Candidate, contacts: tuple[Contact, ...], outline: OutlineBelief) -> Candidate:
    return replace(candidate, contour=outline.contour, contacts=contacts, quality=quality(outline))


def _touched_all_round(c: Candidate) -> bool:
    return contour_quality(np.array([k.tip_K_m[:2] for k in c.contacts]), c.contour) >= SURE


def part_of(known: tuple[Candidate, ...], first: Contact, radius_m: float) -> Candidate | None:
    """The candidate a new contact is with: no other can be so near, or one object explains both better than two."""
    for old in sorted(known, key=lambda c: float(signed_distance(envelope(c), first.point_K_m[None])[0])):
        if float(signed_distance(envelope(old), first.point_K_m[None])[0]) > PART_M:
            return None
        off = first.tip_K_m[:2] - old.contour.centre_K_m
        if float(first.reaction_K[:2] @ off) < FACING * float(np.hypot(off[0], off[1])):
            continue
        if _apart_m(old.contacts, first.point_K_m[None]) < BETWEEN_M:
            return old
        one = _outline((*old.contacts, first), radius_m)
        two = _outline(old.contacts, radius_m).log_evidence + _outline((first,), radius_m).log_evidence
        if one.log_evidence > two + np.log(OTHER) and max(one.contour.size_m) <= TraceParams().largest_m:
            return old
    return None


def joins(known: tuple[Candidate, ...], contacts: tuple[Contact, ...], radius_m: float) -> bool:
    """Whether what is being traced turns out to be a candidate: then it will be made one with it, and refining has
    time to learn the rest."""
    points = np.array([c.point_K_m for c in contacts])
    near = (old for old in known if _room_is_shared(old, points))
    return any(max(_outline((*old.contacts, *contacts), radius_m).contour.size_m) <= LARGEST_M for old in near)


def of_another(known: tuple[Candidate, ...], contact: Contact) -> bool:
    """Whether a contact made while something new is traced is with a candidate that is known from all sides."""
    return any(
        float(signed_distance(envelope(c), contact.point_K_m[None])[0]) < ON_M and _touched_all_round(c) for c in known
    )


def _outline(contacts: tuple[Contact, ...], radius_m: float) -> OutlineBelief:
    return believe_outline(
        _places(contacts, radius_m),
        radius_m,
        approach_K=np.array([c.approach_K[:2] for c in contacts]),
        reaction_K=np.array([c.reaction_K[:2] for c in contacts]),
    )


def _merged(old: Candidate, traced: Trace, radius_m: float, height_m: float) -> Candidate | None:
    """The candidate that both are, or None if they are two."""
    points = np.array([c.point_K_m for c in traced.contacts])
    if not _room_is_shared(old, points):
        return None
    shift = np.array([*traced.displaced_K_m, 0.0])
    before = (replace(c, tip_K_m=c.tip_K_m + shift, point_K_m=c.point_K_m + shift[:2]) for c in old.contacts)
    everything = tuple(replace(c, pushed_K_m=np.zeros(2)) for c in (*before, *traced.contacts))
    contacts = split_moved(everything, radius_m, likely=len(old.contacts))[1]
    outline = _outline(contacts, radius_m)
    if max(outline.contour.size_m) > LARGEST_M:
        middle = points.mean(axis=0)[None]
        if float(signed_distance(envelope(old), middle)[0]) > 0.0:
            return None
        # Nothing else can be where it stands: it is what was traced last, and what was felt before was not all its own.
        contacts, outline = traced.contacts, _outline(traced.contacts, radius_m)
    return _with(replace(old, height_m=max(old.height_m, height_m)), contacts, outline)


def _room_is_shared(old: Candidate, points: Array) -> bool:
    """Whether contact points (n, 2) are so near to a candidate that both are one."""
    return float(signed_distance(envelope(old), points).min()) <= SAME_M or _apart_m(old.contacts, points) <= BETWEEN_M


def _apart_m(contacts: tuple[Contact, ...], points: Array) -> float:
    """Distance of points (n, 2) from the hull of the contacts' points; not positive if one is within it."""
    hull = np.array([c.point_K_m for c in contacts])
    if np.linalg.svd(hull - hull.mean(axis=0))[1][1] > FLAT_M:
        return float(polygon_distance(convex_hull(hull), points).min())
    return float(np.linalg.norm(points[:, None] - hull[None], axis=2).min())


def _places(contacts: tuple[Contact, ...], radius_m: float) -> Array:
    """(k, 2) what outlines are fitted to: ball centres, or contact points of what is no ball."""
    return np.array([c.tip_K_m[:2] if radius_m > 0 else c.point_K_m for c in contacts])
