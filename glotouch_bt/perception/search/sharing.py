"""Share the contacts of neighbouring candidates out among bodies anew, by evidence.

A trace can pass from one body to another that touches it. Then a candidate holds contacts of two bodies, or a body is
two candidates. The bodies are those with the highest evidence: that of an outline for each of them, less a penalty for
each overlap. A greedy search from the present candidates maximises it. In a step, one
contact or the first or last contacts of a body pass to a neighbour, a line divides two bodies that overlap anew, two
bodies become one, or the contacts of one body pass to several neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import combinations

import numpy as np

from glotouch_bt.perception.search.bodies import (
    MAX_NATS,
    MIN_BODY_M,
    MIN_PART,
    line_partitions,
    outline_of,
)
from glotouch_bt.perception.search.tracing import TraceParams
from glotouch_bt.perception.touch import Candidate, Contact, Contour, signed_distance
from glotouch_bt.perception.touch.outline import KNOWN_QUALITY, OutlineBelief

OVERLAP_M = 0.008
"""Depth of the overlap, m, above which two outlines contradict each other, because bodies do not overlap. Source: ours;
outlines are known to a few millimetres."""
OVERLAP_SD_M = 0.003
"""Standard deviation of the depth to which the outlines of two bodies seem to overlap. Source: ours."""
MAX_OVERLAP_NATS = 60.0
"""Log evidence that an overlap costs at most: an outline that is hardly known may be far off. Source: ours."""
MISFIT_M = 0.005
"""Root mean square distance, m, of contacts from their outline above which they are not those of one body. Source:
ours; limbs of a figure lie a few millimetres off its outline."""
MIN_GAIN_NATS = 3.0
"""Minimum gain of log evidence of a step. Source: ours."""
NEAR_M = 0.015
"""Maximum distance from another body's outline of a contact that may be with it. Source: ours."""
MAX_STEPS = 50
"""Maximum number of steps. Each gains evidence, so they end anyway. Source: ours."""

Groups = dict[int, tuple[Contact, ...]]
"""Contacts of each body, in order of time, by the index of its candidate."""


def shared_out(
    candidates: tuple[Candidate, ...], radius_m: float, preferred: frozenset[int] = frozenset()
) -> dict[int, tuple[Contact, ...]]:
    """Return the contacts of each body by the index of its candidate; candidates that are parts of others are missing.

    Args:
        candidates: All candidates.
        radius_m: Radius of the ball; 0 for another section, whose contacts stay as they are.
        preferred: Indices of candidates that are kept.
    """
    now: Groups = {c.index: c.contacts for c in candidates}
    if radius_m == 0.0:
        return now
    outlines = _Outlines(radius_m)
    settled: set[frozenset[frozenset[int]]] = set()
    for _ in range(MAX_STEPS):
        pairs = outlines.neighbours(now)
        steps = []
        for pair in pairs:
            if (groups := frozenset(_ids(now[i]) for i in pair)) not in settled:
                best = outlines.best(now, outlines.of_pair(now, *pair, preferred), pair)
                if best is None:
                    settled.add(groups)
                else:
                    steps.append(best)
        if not steps:
            steps = [s for s in (outlines.dissolved(now, i, pairs) for i in now if i not in preferred) if s is not None]
        if not steps:
            break
        now = max(steps, key=lambda step: step[0])[1]
    return now


def overlap_depth_m(a: Contour, b: Contour) -> float:
    """Return how deep one outline reaches into the other; negative if they are apart."""
    return -min(float(signed_distance(one, other.outline_K_m()).min()) for one, other in ((a, b), (b, a)))


def contradictions(candidates: Sequence[Candidate]) -> dict[int, str]:
    """Return the index of each candidate whose outline cannot be right, and why.

    It is uncertain, it is narrower than any object, its contacts do not fit it, or it is the less certain one of two
    that overlap: bodies do not. Traces that pass on to a neighbour leave such outlines, and objects that are pushed
    while they are traced.
    """
    wrong = {c.index: why for c in candidates if (why := _why_wrong(c))}
    for one, other in combinations((c for c in candidates if c.index not in wrong), 2):
        depth_m = overlap_depth_m(one.contour, other.contour)
        if depth_m > OVERLAP_M:
            worse, better = sorted((one, other), key=lambda c: c.quality)
            wrong.setdefault(
                worse.index, f"its outline overlaps that of candidate {better.index} by {1e3 * depth_m:.0f} mm"
            )
    return wrong


def _why_wrong(candidate: Candidate) -> str:
    """Return why an outline cannot be right by itself; empty if it may be."""
    if candidate.quality < KNOWN_QUALITY:
        return "its outline is still uncertain"
    if (width_m := min(candidate.contour.size_m)) < MIN_BODY_M:
        return f"its outline is only {1e3 * width_m:.0f} mm wide"
    points = np.array([c.point_K_m for c in candidate.contacts])
    misfit_m = float(np.sqrt(np.mean(signed_distance(candidate.contour, points) ** 2)))
    return f"its contacts are {1e3 * misfit_m:.0f} mm off its outline" if misfit_m > MISFIT_M else ""


def _ids(contacts: tuple[Contact, ...]) -> frozenset[int]:
    """Return what tells a group of contacts from others."""
    return frozenset(map(id, contacts))


def _in_time(*groups: tuple[Contact, ...]) -> tuple[Contact, ...]:
    return tuple(sorted((c for group in groups for c in group), key=lambda c: c.stamp_s))


class _Group:
    """Contacts in their order as the key of a cache; they are handed on, never copied."""

    def __init__(self, contacts: tuple[Contact, ...]) -> None:
        self.contacts, self.ids = contacts, tuple(map(id, contacts))

    def __hash__(self) -> int:
        return hash(self.ids)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Group) and self.ids == other.ids


@lru_cache(maxsize=2048)
def _outline(group: _Group, radius_m: float) -> OutlineBelief:
    return outline_of(group.contacts, radius_m)


@dataclass
class _Outlines:
    """Outlines of groups of contacts, and what they say about the steps.

    Attributes:
        radius_m: Radius of the ball.
    """

    radius_m: float
    _depths: dict[frozenset[frozenset[int]], float] = field(default_factory=dict)

    def of(self, contacts: tuple[Contact, ...]) -> OutlineBelief:
        """Return the outline of one body with these contacts."""
        return _outline(_Group(contacts), self.radius_m)

    def overlap_m(self, a: tuple[Contact, ...], b: tuple[Contact, ...]) -> float:
        """Return the depth of the overlap of two bodies; 0 if they are apart."""
        one, other = self.of(a).contour, self.of(b).contour
        reach = 0.5 * float(np.hypot(*one.size_m) + np.hypot(*other.size_m)) + NEAR_M
        if float(np.linalg.norm(one.centre_K_m - other.centre_K_m)) > reach:
            return 0.0
        key = frozenset((_ids(a), _ids(b)))
        if key not in self._depths:
            self._depths[key] = max(overlap_depth_m(one, other), 0.0)
        return self._depths[key]

    def neighbours(self, now: Groups) -> list[tuple[int, int]]:
        """Return the pairs of bodies of which one has contacts near the other's outline."""

        def near(i: int, j: int) -> bool:
            points = np.array([c.point_K_m for c in now[i]])
            return bool((signed_distance(self.of(now[j]).contour, points) < NEAR_M).any())

        return [(i, j) for i, j in combinations(now, 2) if near(i, j) or near(j, i)]

    def evidence(self, now: Groups, changed: tuple[int, ...]) -> float:
        """Return the log evidence of the bodies of these indices, and of their overlaps with all others."""
        there = [i for i in changed if i in now]
        total = sum(self.of(now[i]).log_evidence for i in there)
        for i, j in combinations(now, 2):
            if i in there or j in there:
                squared = 0.5 * (self.overlap_m(now[i], now[j]) / OVERLAP_SD_M) ** 2
                total -= min(squared, MAX_OVERLAP_NATS)
        return float(total)

    def best(self, now: Groups, steps: Iterator[Groups], changed: tuple[int, ...]) -> tuple[float, Groups] | None:
        """Return the step with the largest gain of log evidence, and this gain; None if none gains enough."""
        before, best = self.evidence(now, changed), None
        gain = MIN_GAIN_NATS
        for step in steps:
            parts = sorted((step[i] for i in changed if i in step), key=len)
            limit = self.of(parts[-1]).log_evidence
            if len(parts) == 2 and limit + MAX_NATS * len(parts[0]) < before + gain:
                continue
            if sum(self.of(part).log_evidence for part in parts) <= before + gain:
                continue  # overlaps can only lower it, and computing them costs as much as inferring the outlines
            if not all(self.is_plausible(part) for part in parts):
                continue
            its = self.evidence(step, changed) - before
            if its > gain:
                gain, best = its, step
        return None if best is None else (gain, best)

    def is_plausible(self, contacts: tuple[Contact, ...]) -> bool:
        """Return True if one body may have these contacts."""
        size_m = self.of(contacts).contour.size_m
        return min(size_m) >= MIN_BODY_M and max(size_m) <= TraceParams().largest_m

    def of_pair(self, now: Groups, i: int, j: int, preferred: frozenset[int]) -> Iterator[Groups]:
        """Return the steps that change two bodies."""
        for giver, taker in ((i, j), (j, i)):
            mine, its = now[giver], now[taker]
            distance_m = signed_distance(self.of(its).contour, np.array([c.point_K_m for c in mine]))
            near = [c for c, d in zip(mine, distance_m, strict=True) if d < NEAR_M]
            passing: list[tuple[Contact, ...]] = [(c,) for c in near]
            passing += [part for k in range(2, len(mine)) for part in (mine[:k], mine[-k:]) if near]
            for part in passing:
                left = tuple(c for c in mine if not any(c is p for p in part))
                if len(left) >= MIN_PART:
                    yield now | {giver: left, taker: _in_time(its, part)}
        both = _in_time(now[i], now[j])
        gone = j if i in preferred else i if j in preferred else min(i, j, key=lambda k: len(now[k]))
        if not {i, j} <= preferred:
            kept = j if gone == i else i
            yield {k: v for k, v in (now | {kept: both}).items() if k != gone}
        if self.overlap_m(now[i], now[j]) >= OVERLAP_M:
            mine_ids = _ids(now[i])
            for mask in line_partitions(np.array([c.point_K_m for c in both])):
                sides = [tuple(c for c, m in zip(both, mask, strict=True) if m == side) for side in (True, False)]
                sides.sort(key=lambda side: -len(_ids(side) & mine_ids) / len(side))
                yield now | {i: sides[0], j: sides[1]}

    def dissolved(self, now: Groups, index: int, pairs: list[tuple[int, int]]) -> tuple[float, Groups] | None:
        """Return the step by which each contact of a body passes to one of several neighbours, and its gain."""
        around = tuple(b if a == index else a for a, b in pairs if index in (a, b))
        if len(around) < 2:
            return None
        step = {i: group for i, group in now.items() if i != index}

        def gain(contact: Contact, to: int) -> float:
            return self.of(_in_time(step[to], (contact,))).log_evidence - self.of(step[to]).log_evidence

        for contact in now[index]:
            taker = max(around, key=lambda to: gain(contact, to))
            step[taker] = _in_time(step[taker], (contact,))
        return self.best(now, iter((step,)), (index, *around))
