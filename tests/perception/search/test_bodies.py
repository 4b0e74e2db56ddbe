"""Contours of one body and of several: discs and boxes whose outlines are known in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import glotouch_bt.perception.search.bodies as search_bodies
import glotouch_bt.perception.search.candidates as candidates
from glotouch_bt.perception.search import OutlineTrace, SearchMap, admit, search_policy, seek_next
from glotouch_bt.perception.search.bodies import (
    Doubt,
    bodies,
    chance_of_fewer,
    distinct,
    division,
    doubts,
    outline_of,
)
from glotouch_bt.perception.search.candidates import divided, division_of, regroup
from glotouch_bt.perception.touch import Candidate, Contact
from tests.support.ball_contacts import NO_PATH, R, box, candidate, contact, disc

LEFT = disc(-0.03, 0.0, 0.03, (60, 105, 150, 195, 240, 290))
RIGHT = disc(0.02, 0.0, 0.02, (-80, -30, 10, 60, 110))


@pytest.mark.parametrize("one", [LEFT, RIGHT, box(0.0, 0.1, 0.044)], ids=["disc", "small disc", "box"])
def test_what_one_outline_explains_is_one_body(one: tuple[Contact, ...]) -> None:
    assert bodies(one, R, NO_PATH) == (one,)


@pytest.mark.parametrize(
    ("one", "other"), [(LEFT, RIGHT), (box(-0.05, 0.1, 0.044), disc(0.033, 0.0, 0.033, (-100, -50, 0, 50, 100)))]
)
def test_two_bodies_that_touch_are_told_apart_without_a_gap(
    one: tuple[Contact, ...], other: tuple[Contact, ...]
) -> None:
    found = bodies((*one, *other), R, NO_PATH)
    assert {frozenset(id(c) for c in part) for part in found} == {
        frozenset(id(c) for c in part) for part in (one, other)
    }


def test_a_square_that_fingers_traced_is_one_body() -> None:
    """Contact points up to 16 mm off, as of fingers that met a corner of the square with a corner of theirs."""
    off = np.random.default_rng(1).choice([0.0, 0.002, 0.016], 16)
    sides = np.repeat(np.arange(4) * np.pi / 2, 4)
    along = np.tile([-0.024, -0.008, 0.008, 0.024], 4)
    x, y = (0.03 + off) * np.cos(sides) - along * np.sin(sides), (0.03 + off) * np.sin(sides) + along * np.cos(sides)
    points = tuple(contact(*p) for p in zip(x, y, sides, strict=True))
    assert bodies(points, 0.0, NO_PATH) == (points,)


def test_too_few_contacts_are_one_body() -> None:
    assert bodies(LEFT[:3], R, NO_PATH) == (LEFT[:3],)


def test_a_contour_of_two_bodies_becomes_two_candidates_that_count() -> None:
    contacts = (*LEFT, *RIGHT)
    traced = OutlineTrace(contacts, outline_of(contacts, R), np.zeros(2), NO_PATH)
    admitted = admit(SearchMap.blank((0.2, 0.15), expected=2), (), contacts[0], traced, 0.018, 0.01)
    assert (admitted.changed, admitted.belief.found) == ((0, 1), 2)
    centres = [c.contour.centre_K_m for c in admitted.candidates]
    np.testing.assert_allclose(centres, [[-0.03, 0.0], [0.02, 0.0]], atol=3e-3)


def test_parts_of_one_body_are_doubtful_and_bodies_far_apart_are_not() -> None:
    halves = candidate(0, LEFT[:3]), candidate(1, LEFT[3:])
    far = candidate(2, disc(0.1, 0.1, 0.03, (0, 60, 120, 180, 240, 300)))
    (doubt,) = doubts((*halves, far), R, NO_PATH)
    assert [c.index for c in doubt.pair] == [0, 1]


@pytest.mark.parametrize(
    ("gain", "length_m", "contacts", "log_odds"),
    [
        (0.0, 0.060, (LEFT, LEFT[:3]), 5.2 - 0.0285 * 60.0),  # the contacts of one lie on the outline of the other
        (40.0, 0.060, (LEFT, LEFT[:3]), 5.2 - 0.021 * 40.0 - 0.0285 * 60.0),
        (500.0, 0.100, (LEFT, LEFT[:3]), 5.2 - 0.021 * 120.0 - 0.0285 * 100.0),
        (0.0, 0.060, (LEFT, RIGHT), 5.2 - 0.085 * 32.5 - 0.0285 * 60.0),  # median of 17 to 40 mm
        (120.0, 0.200, (LEFT, RIGHT), None),  # two bodies almost for certain
    ],
)
def test_a_doubt_follows_from_evidence_distance_and_length(
    monkeypatch: pytest.MonkeyPatch, gain: float, length_m: float, contacts: Any, log_odds: float | None
) -> None:
    monkeypatch.setattr(search_bodies, "compared", lambda *_: (gain, length_m))
    pair = tuple(replace(candidate(i, c), quality=q) for i, (c, q) in enumerate(zip(contacts, (0.5, 0.2), strict=True)))
    found = [d.chance for d in doubts(pair, R, NO_PATH)]
    assert found == ([] if log_odds is None else [pytest.approx(1.0 / (1.0 + np.exp(-log_odds)), abs=0.02)])


def test_the_chance_of_fewer_bodies_takes_pairs_as_independent() -> None:
    pair = candidate(0, LEFT), candidate(1, RIGHT)
    two = Doubt(pair, 0.5), Doubt(pair, 0.2)
    assert chance_of_fewer(()) == 0.0
    assert chance_of_fewer(two) == pytest.approx(0.6)
    assert chance_of_fewer(two, surplus=1) == pytest.approx(0.1), "one more was traced than expected"
    assert chance_of_fewer(two, surplus=2) == 0.0


@pytest.mark.parametrize(("expected", "doubt"), [(3, True), (2, False)])
def test_a_surplus_makes_up_for_a_doubtful_pair(expected: int, doubt: bool) -> None:
    belief = SearchMap.blank((0.2, 0.15), expected=expected)
    halves = candidate(0, LEFT[:3]), candidate(1, LEFT[3:5])
    for c in halves:
        belief = belief.with_exclusion(c.contour, 0.01)
    far = disc(0.1, 0.1, 0.03, (0, 60, 120, 180, 240, 300))
    traced = OutlineTrace(far, outline_of(far, R), np.zeros(2), NO_PATH)
    admitted = admit(belief, halves, far[0], traced, 0.018, 0.01)
    assert admitted.belief.found == 3
    assert (admitted.belief.doubt > 0.0) is doubt


def test_parts_that_turn_out_to_be_one_body_are_one_candidate() -> None:
    """The others keep their indices."""
    far = candidate(2, disc(0.1, 0.1, 0.03, (0, 60, 120, 180, 240, 300)))
    parts = candidate(0, LEFT[:3]), candidate(1, LEFT[3:5])
    belief = SearchMap.blank((0.2, 0.15), expected=3)
    for c in (*parts, far):
        belief = belief.with_exclusion(c.contour, 0.01)
    first = admit_nothing(belief, (*parts, far))
    traced = OutlineTrace(LEFT[3:], outline_of(LEFT[3:], R), np.zeros(2), NO_PATH)
    after = regroup(first, 0, 1, traced, 0.01)
    assert [c.index for c in after.candidates] == [0, 2]
    assert after.belief.found == 2
    assert after.candidates[0].contour.size_m == pytest.approx((0.06, 0.06), abs=2e-3)
    assert after.candidates[1].contour is far.contour


def test_of_candidates_that_overlap_deeply_one_is_kept() -> None:
    good, rough = candidate(0, LEFT), candidate(1, LEFT[:4])
    beside = candidate(2, disc(0.06, 0.0, 0.03, (0, 60, 120, 180, 240, 300)))
    assert max(good.quality, rough.quality) == good.quality
    assert [c.index for c in distinct((rough, good, beside))] == [0, 2]
    assert [c.index for c in distinct((rough, good, beside), frozenset({1}))] == [1, 2]


def admit_nothing(belief: SearchMap, candidates: tuple[Candidate, ...]):
    """The state after a trace that gave nothing."""
    nothing = OutlineTrace((), None, np.zeros(2), NO_PATH)
    return admit(belief, candidates, LEFT[0], nothing, 0.018, 0.01)


def searched(expected: int, share: float = 1.0) -> SearchMap:
    """A map of which a share is swept in narrow rows, with the contour of two discs on it."""
    belief = SearchMap.blank((0.138, 0.188), expected)
    y = np.arange(-0.188, -0.188 + share * 0.376, 0.02)
    x = np.tile([-0.138, 0.138, 0.138, -0.138], len(y))[: 2 * len(y)]
    return belief.with_path(np.column_stack([x, np.repeat(y, 2)]))


@pytest.mark.parametrize(
    ("expected", "share", "number"),
    [(2, 1.0, 2), (1, 1.0, 1), (2, 0.1, 1)],
    ids=["one is missing", "none", "unsearched"],
)
def test_a_missing_object_is_a_part_of_another_one_once_all_is_searched(
    expected: int, share: float, number: int
) -> None:
    """The free path is no evidence here: the rows lead through the discs."""
    whole = candidate(0, (*LEFT, *RIGHT))
    belief = searched(expected, share).with_exclusion(whole.contour, 0.01, 0)
    belief = replace(belief, path_K_m=belief.path_K_m[np.linalg.norm(belief.path_K_m, axis=1) > 0.075])
    two = division_of(belief, (whole,), R)
    assert (two is not None and two.is_likelier(belief)) is (number == 2)
    if two is None or number == 1:
        return
    odds = np.exp(-3.9 + 0.29 * 12.0) * 1 / 2  # one object is missing, and the one found may be one of the two
    assert two.share == pytest.approx(odds / (1.0 + odds))
    found = divided(belief, (whole,), two, R)
    assert found.belief.found == 2
    parts = sorted(found.candidates, key=lambda c: c.contour.centre_K_m[0])
    assert {id(c) for c in parts[0].contacts} == {id(c) for c in LEFT}
    assert [e.given_margin_m for e in found.belief.exclusions] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize(("share", "divides"), [(0.85, True), (0.5, False)])
def test_a_candidate_is_divided_as_soon_as_a_hidden_object_is_less_likely(
    monkeypatch: pytest.MonkeyPatch, share: float, divides: bool
) -> None:
    """With 11 % of the places left, the search ends without another move; with 48 % it goes on."""
    monkeypatch.setattr(candidates, "doubts", lambda *_: ())
    whole = candidate(0, (*LEFT, *RIGHT))
    belief = searched(2, share).with_exclusion(whole.contour, 0.01, 0)
    belief = replace(belief, path_K_m=belief.path_K_m[np.linalg.norm(belief.path_K_m, axis=1) > 0.075])
    plan = seek_next(belief, (whole,), search_policy("expected_find", 0), np.array([0.13, 0.18]), R, lowered=True)
    if not divides:
        assert next(plan).kind in ("sweep", "hop")
        return
    with pytest.raises(StopIteration) as ended:
        next(plan)
    sought, known = ended.value.value
    assert (sought.contact, sought.belief.complete, len(known)) == (None, True, 2)


def test_the_gain_of_a_division_is_that_of_its_parts() -> None:
    gain, parts = division((*LEFT, *RIGHT), R, NO_PATH)
    alone = sum(outline_of(part, R).log_evidence for part in parts)
    assert gain == pytest.approx(alone - outline_of((*LEFT, *RIGHT), R).log_evidence)
    assert gain > 12.0 > division(box(0.0, 0.1, 0.044), R, NO_PATH)[0]
    assert division(LEFT[:3], R, NO_PATH)[0] == -np.inf
