"""seek, told by a script what each move met."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from glotouch_bt.perception.search import Move, MoveOutcome, SearchMap, Sought, Stretch, seek
from glotouch_bt.perception.search.policies.expectation import ExpectedFind
from glotouch_bt.perception.search.seeking import MAX_HOPS, RETREAT_M
from glotouch_bt.perception.touch import Contact, Contour
from glotouch_bt.robot import Array

HALF = np.array([0.138, 0.188])
DISC = Contour("round", np.array([0.05, 0.0]), (0.06, 0.06), 0.0, 0.0, np.zeros(0))
Answer = Callable[[Move, Array], MoveOutcome]


def blank(half: Array = HALF) -> SearchMap:
    return SearchMap.blank(half, expected=2)


def touch(tip: Array, along: Array) -> Contact:
    way = np.array([*along, 0.0]) / np.linalg.norm(along)
    return Contact(0.0, np.array([*tip, 0.018]), way, -way, tip + 0.006 * way[:2], 1.0)


def free(move: Move, tip: Array) -> MoveOutcome:
    """Nothing is met."""
    return MoveOutcome(move.goal_K_m, np.array([move.goal_K_m if move.kind == "hop" else tip, move.goal_K_m]))


class Towards:
    """A policy that goes to given places in turn, and then nowhere."""

    def __init__(self, *places: tuple[float, float], raised: bool = False) -> None:
        self.places, self.raised = list(places), raised

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        return Stretch(np.array([self.places.pop(0)]), raised=self.raised) if self.places else None


def run(plan: object, tip: Array, answer: Answer) -> tuple[Sought, list[Move]]:
    moves: list[Move] = []
    try:
        move = next(plan)  # type: ignore[call-overload]
        while True:
            moves.append(move)
            assert len(moves) < 500, "it does not end"
            felt = answer(move, tip)
            tip = felt.tip_K_m
            move = plan.send(felt)  # type: ignore[attr-defined]
    except StopIteration as end:
        return end.value, moves


def test_the_way_becomes_evidence_until_the_policy_has_none_left() -> None:
    start = np.array([0.0, -0.1])
    sought, moves = run(seek(blank(), Towards((0.1, -0.1), (0.1, 0.1)), start, lowered=True), start, free)
    assert [m.kind for m in moves] == ["sweep", "sweep"]
    assert (sought.contact, sought.lowered) == (None, True)
    assert sought.belief.path_distance(np.array([[0.05, -0.1], [0.1, 0.0]])).max() < 0.0021


def test_a_refused_sweep_drops_its_own_goal() -> None:
    """Not that of a later leg of the same plan: the next plan would begin with the refused leg again."""

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.kind == "sweep" and move.goal_K_m[0] > 0.0:
            return MoveOutcome(tip, np.zeros((0, 2)), refused="out of reach")
        return free(move, tip)

    start = np.array([-0.01, 0.0])
    sought, moves = run(seek(blank(0.6 * HALF), ExpectedFind(), start, lowered=True), start, answer)
    refused = [m.goal_K_m for m in moves if m.kind == "sweep" and m.goal_K_m[0] > 0.0]
    assert refused
    assert len(np.unique(refused, axis=0)) == len(refused)
    assert sought.contact is None


def test_further_goals_follow_a_way_in_straight_sweeps() -> None:
    stretch = Stretch(np.array([[0.0, 0.1], [0.1, 0.1]]), further_K_m=np.array([[0.1, 0.0]]))
    np.testing.assert_array_equal(stretch.goals_K_m, [[0.1, 0.1], [0.1, 0.1], [0.1, 0.0]])


def test_a_contact_ends_it_and_the_ball_has_retreated() -> None:
    start, stop = np.array([0.0, 0.0]), np.array([0.06, 0.0])

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.kind == "sweep":
            return MoveOutcome(stop, np.array([tip, stop]), touch(stop, move.goal_K_m - tip))
        return free(move, tip)

    sought, moves = run(seek(blank(), Towards((0.1, 0.0)), start, lowered=True), start, answer)
    assert sought.contact is not None
    assert [m.kind for m in moves] == ["sweep", "retreat"]
    np.testing.assert_allclose(moves[-1].goal_K_m, stop - [RETREAT_M, 0.0])


def test_a_traced_object_touched_again_is_no_find() -> None:
    """Its place is given up and kept clear of, and the search goes on."""
    start, stop = np.array([-0.05, 0.0]), np.array([0.015, 0.0])
    known = blank().with_exclusion(DISC, 0.01)

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.kind == "sweep" and move.goal_K_m[0] > 0.0:
            return MoveOutcome(stop, np.array([tip, stop]), touch(stop, move.goal_K_m - tip))
        return free(move, tip)

    sought, moves = run(seek(known, Towards((0.12, 0.0), (-0.1, 0.1)), start, lowered=True), start, answer)
    assert sought.contact is None
    assert "retreat" in [m.kind for m in moves]
    assert np.linalg.norm(sought.belief.dropped - stop, axis=1).min() < 1e-9
    assert len(sought.belief.exclusions) > len(known.exclusions)
    assert sought.belief.found == known.found


def test_no_sweep_out_of_a_corner_is_tried_again() -> None:
    """Between the limbs of a traced object every sweep meets it: the ball is lifted out."""
    start = np.array([0.02, 0.0])
    known = blank().with_path(np.array([[-0.1, 0.0], [-0.06, 0.0]])).with_exclusion(DISC, 0.01)

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.kind == "sweep" and np.linalg.norm(tip) < 0.03:
            return MoveOutcome(tip, np.array([tip]), touch(tip, move.goal_K_m - tip))
        return free(move, tip)

    sought, moves = run(seek(known, Towards(*[(0.12, 0.0)] * 4), start, lowered=True), start, answer)
    assert [m.kind for m in moves][:3] == ["sweep", "retreat", "hop"]
    assert sought.lowered


def test_a_policy_that_goes_to_and_fro_is_left() -> None:
    """Sweeps over what was swept already tell nothing: the search goes on elsewhere, and ends."""

    class ToAndFro:
        def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
            return Stretch(np.array([[0.1 if tip_K_m[0] < 0.05 else 0.0, 0.0]]))

    start = np.array([0.0, 0.0])
    sought, moves = run(seek(blank(), ToAndFro(), start, lowered=True), start, free)
    assert sought.contact is None
    assert len(moves) <= 3 * MAX_HOPS


def test_what_is_refused_is_given_up() -> None:
    start = np.array([0.0, 0.0])

    def answer(move: Move, tip: Array) -> MoveOutcome:
        return MoveOutcome(tip, np.zeros((0, 2)), refused="a wall")

    sought, moves = run(seek(blank(), Towards((0.1, 0.1)), start, lowered=True), start, answer)
    assert (sought.contact, len(sought.belief.path_K_m)) == (None, 0)
    np.testing.assert_array_equal(sought.belief.dropped, [[0.1, 0.1]])
    assert len(moves) <= MAX_HOPS


def test_raised_it_comes_down_first() -> None:
    start, place = np.array([0.02, 0.03]), (0.1, 0.1)  # asked twice: while it hangs, and when it is down
    sought, moves = run(seek(blank(), Towards(place, place), start, lowered=False), start, free)
    assert [m.kind for m in moves] == ["hop", "sweep"]
    np.testing.assert_array_equal(moves[0].goal_K_m, start)
    assert sought.lowered


def test_landing_on_something_it_is_touched_from_its_side() -> None:
    start, middle, radius = np.array([-0.1, 0.1]), np.array([0.02, 0.02]), 0.03

    def answer(move: Move, tip: Array) -> MoveOutcome:
        over = np.linalg.norm(move.goal_K_m - middle) < radius + 0.006
        if move.kind == "hop" and over:
            down = Contact(0.0, np.array([*move.goal_K_m, 0.07]), np.array([0.0, 0, -1]), np.array([0.0, 0, 1]),
                           move.goal_K_m, 1.0)  # fmt: skip
            return MoveOutcome(move.goal_K_m, np.zeros((0, 2)), down)
        if move.kind == "probe":
            way = (move.goal_K_m - tip) / np.linalg.norm(move.goal_K_m - tip)
            stop = middle - (radius + 0.006) * way
            return MoveOutcome(stop, np.array([tip, stop]), touch(stop, way))
        return free(move, tip)

    policy = Towards((float(middle[0]), float(middle[1])), raised=True)
    sought, moves = run(seek(blank(), policy, start, lowered=False), start, answer)
    assert sought.contact is not None
    assert abs(sought.contact.approach_K[2]) < 1e-9, "a contact from the side, not from above"
    assert np.linalg.norm(sought.contact.tip_K_m[:2] - middle) == pytest.approx(radius + 0.006)
    assert sought.lowered
    assert moves[-1].kind == "retreat"


def test_a_side_of_a_traced_object_below_a_landing_is_no_find() -> None:
    """The ball lands on something beside a traced object; lowered next to it, it meets that object's side."""
    start, landing, side = np.array([-0.1, 0.1]), np.array([-0.01, 0.0]), np.array([0.015, 0.0])
    known = blank().with_exclusion(DISC, 0.01)

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.kind == "hop" and np.allclose(move.goal_K_m, landing):
            up = np.array([0.0, 0.0, 1.0])
            down = Contact(0.0, np.array([*landing, 0.05]), -up, up, landing, 1.0)
            return MoveOutcome(landing, np.zeros((0, 2)), down)
        if move.kind == "probe":
            return MoveOutcome(side, np.array([tip, side]), touch(side, np.array([1.0, 0.0])))
        return free(move, tip)

    policy = Towards((float(landing[0]), float(landing[1])), raised=True)
    sought, moves = run(seek(known, policy, start, lowered=False), start, answer)
    assert "probe" in [m.kind for m in moves]
    assert sought.contact is None
    assert np.linalg.norm(sought.belief.dropped - landing, axis=1).min() < 1e-9


def test_a_hint_is_followed_before_the_policy_is_asked() -> None:
    start, place = np.array([-0.1, 0.0]), np.array([0.06, 0.0])
    hint = touch(place, np.array([1.0, 0.0]))

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.goal_K_m[0] > place[0]:
            return MoveOutcome(place, np.array([tip, place]), touch(place, move.goal_K_m - tip))
        return free(move, tip)

    sought, _ = run(seek(blank().with_hints((hint,)), Towards((-0.1, 0.15)), start, lowered=True), start, answer)
    assert sought.contact is not None
    np.testing.assert_allclose(sought.contact.tip_K_m[:2], place)
    assert sought.belief.hints == ()


@pytest.mark.parametrize("occupied", [False, True])
def test_a_raised_ball_is_lowered_beside_a_hint(occupied: bool) -> None:
    """If something stands there, the hint is given up."""
    start, place = np.array([-0.1, 0.0]), np.array([0.06, 0.0])
    hint = touch(place, np.array([1.0, 0.0]))

    def answer(move: Move, tip: Array) -> MoveOutcome:
        if move.kind == "hop" and occupied and move.goal_K_m[0] > 0.0:
            return MoveOutcome(move.goal_K_m, np.zeros((0, 2)), touch(move.goal_K_m, np.array([0.0, 1.0])))
        if move.kind == "sweep" and move.goal_K_m[0] > place[0]:
            return MoveOutcome(place, np.array([tip, place]), touch(place, move.goal_K_m - tip))
        return free(move, tip)

    policy = Towards((-0.1, 0.15), raised=True)
    sought, moves = run(seek(blank().with_hints((hint,)), policy, start, lowered=False), start, answer)
    assert (moves[0].kind, sought.belief.hints) == ("hop", ())
    assert np.hypot(*(moves[0].goal_K_m - place)) < 0.02
    assert (sought.contact is None) == occupied
    if not occupied:
        assert [m.kind for m in moves] == ["hop", "sweep", "retreat"]
        np.testing.assert_allclose(sought.contact.tip_K_m[:2], place)


def test_a_hint_on_a_traced_object_is_passed_over() -> None:
    start = np.array([-0.1, 0.0])
    hint = touch(np.array([0.05, 0.0]), np.array([1.0, 0.0]))
    known = blank().with_exclusion(DISC, 0.01).with_hints((hint,))
    sought, moves = run(seek(known, Towards(), start, lowered=True), start, free)
    assert (sought.contact, sought.belief.hints) == (None, ())
    assert all(m.kind != "sweep" for m in moves)


def test_an_unknown_number_is_sought_until_hardly_anything_can_be_left() -> None:
    """After the first sweep the chance is below the limit, though the policy would go on."""
    belief = SearchMap.blank(HALF, expected=None, left_below=0.8)
    rows = np.arange(-HALF[1], HALF[1] - 0.05, 0.02)
    x = np.tile([-HALF[0], HALF[0], HALF[0], -HALF[0]], len(rows))[: 2 * len(rows)]
    belief = belief.with_path(np.column_stack([x, np.repeat(rows, 2)]))
    start = belief.path_K_m[-1]
    sought, moves = run(seek(belief, Towards((0.1, 0.18), (-0.1, 0.18)), start, lowered=True), start, free)
    assert (len(moves), sought.contact) == (0, None)
    strict = SearchMap.blank(HALF, expected=None, left_below=0.0)
    sought, moves = run(seek(strict, Towards((0.1, 0.18), (-0.1, 0.18)), start, lowered=True), start, free)
    assert [m.kind for m in moves[:2]] == ["sweep", "sweep"]


def test_what_encloses_the_whole_path_is_left_by_an_unvisited_place() -> None:
    """The first object stands in the corner where the search begins."""
    corner = np.array([-0.13, -0.18])
    around = Contour("round", corner, (0.08, 0.08), 0.0, 0.0, np.zeros(0))
    belief = blank().with_path([corner, (-0.12, -0.18)]).with_exclusion(around, 0.01)

    class Outside:
        def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
            return None if belief.inside_exclusion(tip_K_m[None])[0] else Stretch(np.array([[0.1, 0.15]]))

    def answer(move: Move, tip: Array) -> MoveOutcome:
        stop = np.array([0.06, 0.12])
        return (
            MoveOutcome(stop, np.array([tip, stop]), touch(stop, stop - tip))
            if move.kind == "sweep"
            else free(move, tip)
        )

    sought, moves = run(seek(belief, Outside(), corner, lowered=True), corner, answer)
    assert [m.kind for m in moves] == ["hop", "sweep", "retreat"]
    assert np.linalg.norm(moves[0].goal_K_m - corner) > 0.05
    assert sought.contact is not None


def test_a_search_that_is_short_of_objects_ends_when_enough_is_searched() -> None:
    rows = np.arange(-HALF[1], HALF[1] + 0.01, 0.02)
    path = np.column_stack([np.tile([-0.138, 0.138, 0.138, -0.138], len(rows))[: 2 * len(rows)], np.repeat(rows, 2)])
    belief, start = blank().with_path(path), np.zeros(2)
    sought, moves = run(seek(belief, Towards((0.1, 0.0)), start, lowered=True, enough=0.01), start, free)
    assert (moves, sought.contact) == ([], None)
    assert len(run(seek(belief, Towards((0.1, 0.0)), start, lowered=True), start, free)[1]) > 0
