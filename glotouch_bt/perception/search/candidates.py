"""Assignment of a trace to a new or an existing candidate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import scipy

from glotouch_bt.perception.search.belonging import MAX_LENGTH_M, is_fully_traced, lies_over, overlaps
from glotouch_bt.perception.search.bodies import (
    SEPARATE_NATS,
    Doubt,
    bodies,
    chance_of_fewer,
    division,
    doubts,
    outline_of,
    same_body,
)
from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.sharing import shared_out
from glotouch_bt.perception.search.suspects import TWO_BODIES
from glotouch_bt.perception.search.tracing import OutlineTrace
from glotouch_bt.perception.touch import (
    Candidate,
    Contact,
    Contour,
    signed_distance,
    split_at_motion,
)
from glotouch_bt.perception.touch.outline import OutlineBelief, envelope, occupied
from glotouch_bt.robot import Array

MIN_CONTACTS = 3
"""Minimum number of contacts of a candidate's outline."""
HALF_QUALITY_SD_M = 0.005
"""Standard deviation of the centre at quality 1/2."""
UNMET = 0.01
"""Probability that an object was not met although the path touched its place: the least share of places left that is
told apart from none. Source: ours."""


@dataclass(frozen=True)
class Admitted:
    """Map and candidates after a trace.

    Attributes:
        belief: The map.
        candidates: All candidates.
        index: Index of the new or updated candidate; None if the trace gave none.
        changed: Indices of all new or updated candidates, `index` first: one contour may be several bodies.
        doubts: Neighbours that may be one body.
    """

    belief: SearchMap
    candidates: tuple[Candidate, ...]
    index: int | None
    changed: tuple[int, ...] = ()
    doubts: tuple[Doubt, ...] = ()


def admit(
    belief: SearchMap,
    known: tuple[Candidate, ...],
    first: Contact,
    traced: OutlineTrace,
    height_m: float,
    exclusion_m: float,
    *,
    part_of: Candidate | None = None,
) -> Admitted:
    """Add a trace to the map and to the candidates; a contour that two bodies explain better becomes two candidates.

    The travelled path becomes free space and the outliers become hints. Without enough contacts for an outline, the
    position of the first contact is dropped. A trace at an existing candidate is merged with it and not counted again.

    Args:
        belief: Map before the trace.
        known: Candidates before the trace.
        first: Contact that started the trace.
        traced: Result of the trace.
        height_m: Height of the sensing plane: a lower bound of the object's height.
        exclusion_m: Margin around the object that the search avoids.
        part_of: Candidate whose contacts started the trace.
    """
    outliers = tuple(c for c in traced.outliers if not belief.at_wall(c))
    belief = belief.with_path(traced.path_K_m).with_hints((*belief.hints, *outliers))
    if traced.outline is None or len(traced.contacts) < MIN_CONTACTS:
        return Admitted(belief.with_dropped(first.point_K_m), known, None)
    radius = traced.outline.touches.radius_m
    if part_of is not None and traced.continued:
        better: Candidate | None = _with(part_of, traced.contacts, traced.outline)
    else:
        better = next(
            (m for old in known if (m := _merged(old, traced, radius, height_m, belief.path_K_m)) is not None), None
        )
    if better is None:
        outline = traced.outline
        better = Candidate(
            _index_at(belief, (c.index for c in known), outline.contour),
            outline.contour,
            height_m,
            quality(outline),
            traced.contacts,
            False,
        )
    parts = bodies(better.contacts, radius, belief.path_K_m)
    if len(parts) == 1 and max(better.contour.size_m) > MAX_LENGTH_M:
        # Only one object can be here: keep the newest contacts; some of the earlier ones were another object's.
        better, parts = _with(better, traced.contacts, traced.outline), (traced.contacts,)
    return _with_parts(belief, known, better, parts, radius, exclusion_m)


def _with_parts(
    belief: SearchMap,
    known: tuple[Candidate, ...],
    whole: Candidate,
    parts: tuple[tuple[Contact, ...], ...],
    radius_m: float,
    exclusion_m: float,
) -> Admitted:
    """Return map and candidates with one candidate for each part of `whole`; the first one keeps its index."""
    every = {c.index: c for c in known} | {whole.index: whole}
    changed: list[int] = []
    for body in parts:
        part = _with(whole, body, outline_of(body, radius_m)) if len(parts) > 1 else whole
        index = _index_at(belief, every, part.contour) if changed else whole.index
        every[index] = replace(part, index=index)
        belief = belief.with_exclusion(occupied(every[index]), exclusion_m, index)
        changed.append(index)
    return _admitted(belief, every, radius_m, whole.index, tuple(changed))


@dataclass(frozen=True, eq=False)
class Division:
    """The candidate that is most probably two bodies, because objects are missing.

    Attributes:
        whole: The candidate.
        parts: The contacts of each body, the body with most contacts first.
        share: Share of the places left below which it is more probably two bodies than the missing object is hidden.
    """

    whole: Candidate
    parts: tuple[tuple[Contact, ...], ...]
    share: float

    def is_likelier(self, belief: SearchMap) -> bool:
        """Return True if it is more probably two bodies than a missing object is hidden."""
        return max(belief.anywhere.share, UNMET) < self.share


def division_of(belief: SearchMap, known: tuple[Candidate, ...], radius_m: float) -> Division | None:
    """Return the candidate that is most probably two bodies; None if none can be, or no object is missing.

    With K of N objects traced, each met with probability 1 - h, the odds that K candidates are K + 1 bodies change by
    the ratio of C(N, B) (1 - h)^B h^(N - B) for B = K + 1 and B = K: (N - K) / (K + 1) * (1 - h) / h. At the share h
    that is returned, they are even.

    Args:
        belief, known: Map and candidates.
        radius_m: Radius of the ball; 0 for another section, whose candidates are never divided.
    """
    if belief.expected is None or belief.found >= belief.expected:
        return None
    missing = belief.expected - belief.found
    traced = {e.index for e in belief.exclusions}
    cuts = {c.index: division(c.contacts, radius_m, belief.path_K_m) for c in known if c.index in traced}
    if not cuts:
        return None
    whole = max((c for c in known if c.index in cuts), key=lambda c: cuts[c.index][0])
    gain, parts = cuts[whole.index]
    log_odds = TWO_BODIES["intercept"] + TWO_BODIES["per_nat"] * min(gain, SEPARATE_NATS)
    even = float(scipy.special.expit(log_odds + np.log(missing / (belief.found + 1))))
    return Division(whole, tuple(sorted(parts, key=len, reverse=True)), even)


def divided(belief: SearchMap, known: tuple[Candidate, ...], two: Division, radius_m: float) -> Admitted:
    """Return map and candidates with the two bodies of a candidate.

    Args:
        belief, known: Map and candidates.
        two: The candidate and its parts.
        radius_m: Radius of the ball.
    """
    margin_m = {e.index: e.given_margin_m for e in belief.exclusions}
    return _with_parts(belief, known, two.whole, two.parts, radius_m, margin_m[two.whole.index])


def regroup(admitted: Admitted, whole: int, part: int, more: OutlineTrace, exclusion_m: float) -> Admitted:
    """Divide the contacts of two candidates anew after a further trace of the second one.

    If one body explains all of them, the second candidate is dropped.

    Args:
        admitted: Map and candidates.
        whole, part: Indices of the two candidates.
        more: The further trace.
        exclusion_m: Margin around the objects that the search avoids.
    """
    outliers = tuple(c for c in more.outliers if not admitted.belief.at_wall(c))
    belief = admitted.belief.with_path(more.path_K_m).with_hints((*admitted.belief.hints, *outliers))
    if more.outline is None:
        return replace(admitted, belief=belief)
    radius, every = more.outline.touches.radius_m, {c.index: c for c in admitted.candidates}
    one, other = every[whole], every[part]
    parts = bodies((*one.contacts, *more.contacts), radius, belief.path_K_m)
    changed = tuple(dict.fromkeys((*admitted.changed, whole, part)))
    if len(parts) == 1:
        belief, changed = belief.without_exclusion(part), tuple(i for i in changed if i != part)
        del every[part]
        parts = (split_at_motion(parts[0], radius, likely=len(one.contacts))[1],)
    return _assign_parts(
        replace(admitted, belief=belief, changed=changed), every, (one, other), parts, radius, exclusion_m
    )


def separated(
    candidates: tuple[Candidate, ...], radius_m: float, preferred: frozenset[int] = frozenset()
) -> tuple[Candidate, ...]:
    """Return the candidates with the contacts that are probably theirs; see `shared_out`.

    A candidate whose contacts all belong to others is left out. A candidate's top becomes unknown again if its former
    centre is outside the new outline, because another body was touched there.

    Args:
        candidates: All candidates.
        radius_m: Radius of the ball; 0 for another section, whose candidates stay as they are.
        preferred: Indices of candidates that are kept.
    """
    bodies_of = shared_out(candidates, radius_m, preferred)
    out = []
    for c in candidates:
        contacts = bodies_of.get(c.index)
        if contacts is c.contacts:
            out.append(c)
        elif contacts is not None:
            new = _with(c, contacts, outline_of(contacts, radius_m))
            elsewhere = float(signed_distance(new.contour, c.contour.centre_K_m[None])[0]) > 0.0
            out.append(replace(new, top_touched=False) if elsewhere else new)
    return tuple(out)


def all_separated(admitted: Admitted, radius_m: float, exclusion_m: float) -> Admitted:
    """Return map and candidates after `separated`; the new candidate may have become a part of another one.

    Args:
        admitted: Map and candidates.
        radius_m: As for `separated`.
        exclusion_m: Margin around the objects that the search avoids.
    """
    now = separated(admitted.candidates, radius_m)
    altered = tuple(c.index for c in now if not any(c is old for old in admitted.candidates))
    if admitted.index is None or not altered:
        return admitted
    belief, every = admitted.belief, {c.index: c for c in now}
    for old in admitted.candidates:
        new = every.get(old.index)
        if new is None:
            belief = belief.without_exclusion(old.index)
        elif new is not old:
            belief = belief.with_exclusion(occupied(new), exclusion_m, new.index)
    changed = tuple(i for i in dict.fromkeys((*admitted.changed, *altered)) if i in every)
    return _admitted(belief, every, radius_m, admitted.index if admitted.index in every else changed[0], changed)


def _assign_parts(
    admitted: Admitted,
    every: dict[int, Candidate],
    pair: tuple[Candidate, Candidate],
    parts: tuple[tuple[Contact, ...], ...],
    radius_m: float,
    exclusion_m: float,
) -> Admitted:
    """Return the result with new contacts of two candidates, and further candidates if there are more parts.

    The part with most contacts of the first candidate is its own.
    """
    one, other = pair
    belief, changed = admitted.belief, admitted.changed
    mine = {id(c) for c in one.contacts}
    parts = tuple(sorted(parts, key=lambda body: -sum(id(c) in mine for c in body)))
    had = {c.index for c in admitted.candidates}
    for k, body in enumerate(parts):
        outline = outline_of(body, radius_m)
        index = (one, other)[k].index if k < 2 else _index_at(belief, had | set(every), outline.contour)
        every[index] = _with(replace(every.get(index, other), index=index), body, outline)
        belief = belief.with_exclusion(occupied(every[index]), exclusion_m, index)
        changed = tuple(dict.fromkeys((*changed, index)))
    return _admitted(belief, every, radius_m, one.index, changed)


def _index_at(belief: SearchMap, known: Iterable[int], contour: Contour) -> int:
    """Return the index of the nearest candidate that is traced anew where a new outline is; without any, a new one.

    Args:
        belief: The map.
        known: Indices of all candidates.
        contour: The new outline.
    """
    there, middle = set(known), contour.centre_K_m

    def overlaps_it(old: Candidate) -> bool:
        pairs = (envelope(old), middle), (contour, old.contour.centre_K_m)
        return any(float(signed_distance(outline, centre[None])[0]) < 0.0 for outline, centre in pairs)

    places = [c for c in belief.to_replace if c.index not in there and overlaps_it(c)]
    if places:
        return min(places, key=lambda c: float(np.linalg.norm(c.contour.centre_K_m - middle))).index
    traced = (e.index for e in belief.exclusions if e.index is not None)
    return max(belief.first_index, *(i + 1 for i in chain(there, traced)), 0)


def _admitted(
    belief: SearchMap, every: dict[int, Candidate], radius_m: float, index: int, changed: tuple[int, ...]
) -> Admitted:
    """Return the result, with the doubts about neighbours."""
    candidates = tuple(every[i] for i in sorted(every))
    found = doubts(candidates, radius_m, belief.path_K_m)
    surplus = 0 if belief.expected is None else max(belief.found - belief.expected, 0)
    return Admitted(belief.with_doubt(chance_of_fewer(found, surplus)), candidates, index, changed, found)


def refined(before: Candidate, traced: OutlineTrace) -> Candidate | None:
    """Return the candidate updated by a further trace; None if the trace added no contact."""
    if traced.outline is None or len(traced.contacts) == len(before.contacts):
        return None
    return _with(before, traced.contacts, traced.outline)


def lost_among(before: Candidate, after: Candidate, others: tuple[Candidate, ...]) -> bool:
    """Return True if a further trace has moved on from a candidate to a neighbour.

    Then the enclosing circles of its two states do not meet, or it has become the same body as another candidate, in
    which it did not stand before.
    """
    apart = float(np.linalg.norm(after.contour.centre_K_m - before.contour.centre_K_m))
    if apart > 0.5 * (float(np.hypot(*before.contour.size_m)) + float(np.hypot(*after.contour.size_m))):
        return True
    middle = before.contour.centre_K_m[None]
    return any(same_body(after, o) and float(signed_distance(envelope(o), middle)[0]) > 0.0 for o in others)


def quality(outline: OutlineBelief) -> float:
    """Return the certainty of the centre, 0..1: 1 / (1 + (sd / 5 mm)^2), sd over x and y together.

    The coverage of bearings is no substitute: it can be complete around the near end of a long object.
    """
    return 1.0 / (1.0 + (float(np.hypot(*outline.centre_sd_m)) / HALF_QUALITY_SD_M) ** 2)


def _with(candidate: Candidate, contacts: tuple[Contact, ...], outline: OutlineBelief) -> Candidate:
    return replace(candidate, contour=outline.contour, contacts=contacts, quality=quality(outline))


def _merged(
    old: Candidate, traced: OutlineTrace, radius_m: float, height_m: float, path_K_m: Array
) -> Candidate | None:
    """Return the union of candidate and trace, or None if the trace is of another object only.

    Contacts that one body explains best if it moved are those after the motion. The union may still be several bodies.
    """
    points = np.array([c.point_K_m for c in traced.contacts])
    if not overlaps(old, points) and not (is_fully_traced(old) and lies_over(old, traced)):
        return None
    shift = np.array([*traced.displaced_K_m, 0.0])
    before = (replace(c, tip_K_m=c.tip_K_m + shift, point_K_m=c.point_K_m + shift[:2]) for c in old.contacts)
    everything = tuple(replace(c, pushed_K_m=np.zeros(2)) for c in (*before, *traced.contacts))
    contacts = everything
    if len(bodies(everything, radius_m, path_K_m)) == 1:
        contacts = split_at_motion(everything, radius_m, likely=len(old.contacts))[1]
    outline = outline_of(contacts, radius_m)
    if max(outline.contour.size_m) > MAX_LENGTH_M:
        middle = points.mean(axis=0)[None]
        if float(signed_distance(envelope(old), middle)[0]) > 0.0:
            return None
    return _with(replace(old, height_m=max(old.height_m, height_m)), contacts, outline)
