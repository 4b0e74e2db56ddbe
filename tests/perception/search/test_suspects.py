"""A candidate of two bodies is probed between them, and a search in doubt goes there first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glotouch_bt.perception.search import Move, MoveOutcome, SearchMap, seek_next, suspects
from glotouch_bt.perception.search.bodies import Doubt, outline_of
from glotouch_bt.perception.search.policies import search_policy
from glotouch_bt.perception.search.suspects import next_suspect
from glotouch_bt.perception.touch import Candidate, Contact

R = 0.006


def touch(x_m: float, y_m: float, out: tuple[float, float]) -> Contact:
    """Return a contact of the ball with a surface at a place, of which the outward normal is given."""
    normal = np.array([*out, 0.0])
    point = np.array([x_m, y_m])
    return Contact(0.0, np.array([*(point + R * normal[:2]), 0.018]), -normal, normal, point, 1.0)


def two_squares() -> tuple[Contact, ...]:
    """Two squares of 40 mm side by side along x, touched on their long outside: a bar of 80 mm explains it as well."""
    sides = [touch(x, s * 0.02, (0.0, s)) for s in (1.0, -1.0) for x in (-0.035, -0.015, 0.015, 0.035)]
    return (*sides, touch(-0.04, 0.0, (-1.0, 0.0)), touch(0.04, 0.0, (1.0, 0.0)))


def candidate(index: int, contacts: tuple[Contact, ...]) -> Candidate:
    return Candidate(index, outline_of(contacts, R).contour, 0.018, 0.8, contacts, False)


def moved(c: Candidate, index: int, by: tuple[float, float]) -> Candidate:
    shift = np.array(by)
    contour = replace(c.contour, centre_K_m=c.contour.centre_K_m + shift)
    return replace(c, index=index, contour=contour)


@pytest.fixture
def doubtful(monkeypatch: pytest.MonkeyPatch) -> tuple[SearchMap, tuple[Candidate, ...]]:
    """Three candidates of three objects; the first two are probably one body, so the bar is suspected."""
    bar = candidate(2, two_squares())
    pair = moved(bar, 0, (0.0, 0.10)), moved(bar, 1, (0.0, 0.14))
    monkeypatch.setattr(suspects, "doubts", lambda *_: (Doubt(pair, 0.8),))
    halves = tuple(tuple(c for c in bar.contacts if sign * c.point_K_m[0] > 0.0) for sign in (-1.0, 1.0))
    monkeypatch.setattr(suspects, "division", lambda contacts, *_: (12.0, halves if contacts is bar.contacts else ()))
    belief = SearchMap.blank((0.188, 0.188), expected=3)
    for c in (*pair, bar):
        belief = belief.with_exclusion(c.contour, 0.008, c.index)
    return belief.with_doubt(0.8), (*pair, bar)


def test_a_probe_goes_between_the_two_parts_from_outside(doubtful) -> None:
    belief, known = doubtful
    found = next_suspect(belief, known, R)
    assert found is not None
    assert found.index == 2
    for start, goal in found.probes_K_m:
        assert abs(start[0]) < 0.012, "the parts meet at x = 0"
        assert abs(start[1]) == pytest.approx(0.02 + R + suspects.CLEAR_M, abs=0.002)
        assert np.linalg.norm(goal) < 0.01


def test_nothing_is_suspected_without_a_doubt_or_after_its_probe(doubtful) -> None:
    belief, known = doubtful
    assert next_suspect(belief.with_doubt(0.0), known, R) is None
    assert next_suspect(replace(belief, expected=4).with_doubt(0.8), known, R) is None, "one is missing anyway"
    assert next_suspect(replace(belief, expected=None).with_doubt(0.8), known, R) is None
    assert next_suspect(belief, known, 0.0) is None, "contacts of another section do not tell bodies apart"
    assert next_suspect(belief.with_probed(2), known, R) is None


def test_the_search_is_not_over_until_suspects_were_probed(doubtful) -> None:
    belief, _ = doubtful
    rows = np.arange(-0.188, 0.189, 0.012)
    x = np.tile([-0.188, 0.188, 0.188, -0.188], len(rows))[: 2 * len(rows)]
    swept = belief.with_path(np.column_stack([x, np.repeat(rows, 2)]))
    assert not swept.complete
    assert swept.with_probed(None).complete


@pytest.mark.parametrize("occupied", [False, True])
def test_the_ball_comes_down_beside_a_suspect_and_touches_it_before_the_floor_is_searched(doubtful, occupied) -> None:
    """If something stands where it would come down, it takes the other side."""
    belief, known = doubtful
    plan = seek_next(belief, known, search_policy("expected_find", 0), np.array([0.1, 0.1]), R, lowered=True)
    move, asked = next(plan), []
    contact = touch(0.0, 0.01, (0.0, 1.0))
    for _ in range(4):
        asked.append(move)
        met = None
        if move.kind == "hop" and occupied and len(asked) == 1:
            met = replace(contact, approach_K=np.array([0.0, 0.0, -1.0]))
        elif move.kind == "probe":
            met = contact
        try:
            move = plan.send(MoveOutcome(np.asarray(move.goal_K_m), np.zeros((0, 2)), met))
        except StopIteration as end:
            sought, candidates = end.value
            break
    assert [m.kind for m in asked] == ["hop"] * (2 if occupied else 1) + ["probe", "retreat"]
    assert all(isinstance(m, Move) for m in asked)
    assert sought.contact is contact
    assert sought.lowered
    assert candidates == known
    assert sought.belief.probed == (2,)
    if occupied:
        assert np.sign(asked[0].goal_K_m[1]) == -np.sign(asked[1].goal_K_m[1])
