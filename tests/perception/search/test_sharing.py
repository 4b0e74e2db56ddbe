"""Contacts of discs and boxes that stand close together, shared out among candidates anew."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from glotouch_bt.perception.search import SearchMap, separated
from glotouch_bt.perception.search.candidates import Admitted, all_separated
from glotouch_bt.perception.search.sharing import OVERLAP_M, overlap_depth_m
from glotouch_bt.perception.touch import Candidate, Contact
from tests.support.ball_contacts import R, box, candidate, disc

LEFT = disc(-0.03, 0.0, 0.03, (60, 105, 150, 195, 240, 290))
RIGHT = disc(0.02, 0.0, 0.02, (-80, -30, 10, 60, 110))
FAR = disc(0.1, 0.1, 0.03, (0, 60, 120, 180, 240, 300))
"""Two discs that touch, and one that stands alone."""


def groups(candidates: tuple[Candidate, ...]) -> set[frozenset[int]]:
    return {frozenset(map(id, c.contacts)) for c in candidates}


def of(*parts: tuple[Contact, ...]) -> set[frozenset[int]]:
    return {frozenset(map(id, part)) for part in parts}


def admitted(candidates: tuple[Candidate, ...], expected: int) -> Admitted:
    """Map and candidates after the trace of candidate 0."""
    belief = SearchMap.blank((0.2, 0.15), expected=expected)
    for c in candidates:
        belief = belief.with_exclusion(c.contour, 0.01, c.index)
    return Admitted(belief, candidates, 0, (0,))


@pytest.mark.parametrize(
    "mixed",
    [
        ((*LEFT[:3], *RIGHT[3:]), (*LEFT[3:], *RIGHT[:3])),  # each candidate has contacts of both
        ((*LEFT, *RIGHT[:3]), RIGHT[3:]),  # a trace passed on to the neighbour
        ((*LEFT, RIGHT[0]), RIGHT[1:]),  # one contact
    ],
    ids=["mixed", "passed on", "one contact"],
)
def test_each_candidate_gets_the_contacts_of_one_disc(mixed: tuple[tuple[Contact, ...], ...]) -> None:
    before = tuple(candidate(i, contacts) for i, contacts in enumerate(mixed))
    after = separated(before, R)
    assert groups(after) == of(LEFT, RIGHT)
    assert overlap_depth_m(after[0].contour, after[1].contour) < OVERLAP_M
    centres = sorted(tuple(c.contour.centre_K_m) for c in after)
    np.testing.assert_allclose(centres, [[-0.03, 0.0], [0.02, 0.0]], atol=3e-3)


def test_candidates_that_are_right_stay_the_same_objects() -> None:
    before = tuple(candidate(i, contacts) for i, contacts in enumerate((LEFT, RIGHT, FAR)))
    after = separated(before, R)
    assert all(a is b for a, b in zip(after, before, strict=True))


def test_contacts_of_fingers_stay_where_they_are() -> None:
    """Their contact points are too far off."""
    before = candidate(0, (*LEFT[:3], *RIGHT[3:])), candidate(1, (*LEFT[3:], *RIGHT[:3]))
    assert separated(before, 0.0) == before


@pytest.mark.parametrize("preferred", [frozenset(), frozenset({0}), frozenset({1})])
def test_two_halves_of_one_disc_are_one_candidate(preferred: frozenset[int]) -> None:
    (whole,) = separated((candidate(0, FAR[::2]), candidate(1, FAR[1::2])), R, preferred)
    assert groups((whole,)) == of(FAR)
    assert not preferred or whole.index in preferred
    both = separated((candidate(0, FAR[::2]), candidate(1, FAR[1::2])), R, frozenset({0, 1}))
    assert len(both) == 2


def test_a_candidate_between_two_bodies_is_shared_out_between_them() -> None:
    """The third candidate is of a trace that began on the box and ended on the disc beside it."""
    long, disc_beside = box(-0.055, 0.1, 0.044), disc(0.028, 0.0, 0.033, (-150, -100, -50, 0, 50, 100, 150))
    mine, its = (0, 1, 3, 4, 6, 7), (1, 2, 3, 4, 5)
    rest = [c for i, c in enumerate(long) if i not in mine], [c for i, c in enumerate(disc_beside) if i not in its]
    parts = (
        tuple(long[i] for i in mine),
        tuple(disc_beside[i] for i in its),
        (*rest[0], *rest[1]),
    )
    after = separated(tuple(candidate(i, part) for i, part in enumerate(parts)), R)
    assert groups(after) == of(long, disc_beside)


def test_the_result_does_not_depend_on_the_order_of_the_candidates() -> None:
    mixed = (*LEFT, *RIGHT[:2]), RIGHT[2:], FAR
    found = [
        groups(separated(tuple(candidate(i, part) for i, part in enumerate(order)), R)) for order in permutations(mixed)
    ]
    assert all(f == of(LEFT, RIGHT, FAR) for f in found)


def test_a_top_that_was_touched_on_another_body_is_unknown_again() -> None:
    over, beside = replace(candidate(0, (*LEFT, RIGHT[0])), top_touched=True), candidate(1, RIGHT[1:])
    assert separated((over, beside), R)[0].top_touched, "the centre is still inside the outline"
    moved = replace(over, contour=candidate(2, FAR).contour)
    assert not separated((moved, beside), R)[0].top_touched


def test_map_and_candidates_agree_after_a_trace() -> None:
    """The candidate that became a part of another one is searched for no longer, and counts no longer."""
    before = admitted((candidate(0, FAR[::2]), candidate(1, FAR[1::2]), candidate(2, LEFT)), 3)
    assert before.belief.found == 3
    after = all_separated(before, R, 0.01)
    assert after.belief.found == len(after.candidates) == 2
    assert {e.index for e in after.belief.exclusions} == {c.index for c in after.candidates}
    assert after.index in {c.index for c in after.candidates}
    assert after.index in after.changed
    assert all_separated(after, R, 0.01) is after
    nothing = replace(before, index=None)
    assert all_separated(nothing, R, 0.01) is nothing, "the trace gave no candidate"
