"""Which neighbour to take out and where to set it down, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.perception.touch import signed_distance
from glotouch_skills.common.planning import NEEDED_M, Clearing, ClearPlanner, Neighbour, finger_space_m
from glotouch_skills.common.planning.clear_planner import GAPS_M, GRID_M, FreePlace, keeps_gap, placed
from glotouch_skills.common.planning.finger_space import cramped_stances, gap_m, wall_gap_m
from glotouch_skills.make_space.carried import Grip, after_carry

GRIPPER = RIZON4_XENSE.gripper
HALF = np.array([0.15, 0.20])


def last(steps) -> Clearing | None:
    found = None
    for found in steps:  # noqa: B007
        pass
    return found


def stands_at(place: FreePlace, thing):
    """The object where a place says, by the bookkeeping of the carried object."""
    centre = thing.contour.centre_K_m
    return after_carry(thing, Grip(centre, 0.0), Grip(place.moved(centre), place.turn_rad), 0.009)


def assert_gap(gap: float, error: float, one: Neighbour, shift, others) -> None:
    """The gap is this one, to an error, all in m."""
    for least in (gap - error, gap + error):
        assert keeps_gap(one, np.array([shift]), least, others, HALF)[0] == (least < gap)


@pytest.mark.parametrize("shift_m", [0.05, 0.1])
def test_the_gap_of_two_discs_is_the_distance_less_their_radii(found, shift_m: float) -> None:
    one, other = (Neighbour.of(found.round((0.0, y), r)) for y, r in ((0.0, 0.02), (-0.02, 0.03)))
    radius, other_radius = (0.5 * np.ptp(n.points_K_m[:, 0]) for n in (one, other))
    gap = min(0.02 + shift_m - radius - other_radius, 0.2 - shift_m - radius)
    assert_gap(gap, 3e-4, one, [0.0, shift_m], [other])


def test_a_turned_box_reaches_the_wall_with_its_other_side(found) -> None:
    box = Neighbour.of(found.box((0.0, 0.0), (0.08, 0.04)))
    turned = placed(box, FreePlace(0, np.zeros(2), np.zeros(2), 0.5 * math.pi, 0.0))
    assert_gap(0.05 - 0.04, 1e-6, box, [0.1, 0.0], [])
    assert_gap(0.05 - 0.02, 1e-6, turned, [0.1, 0.0], [])


def test_one_that_swallows_the_other_is_not_free(found) -> None:
    small, large = Neighbour.of(found.round((0.0, 0.0), 0.01)), Neighbour.of(found.box((0.05, 0.0), (0.08, 0.08)))
    assert not keeps_gap(small, np.array([[0.05, 0.0]]), 0.0, [large], HALF)[0]
    assert not keeps_gap(large, np.array([[-0.05, 0.0]]), 0.0, [small], HALF)[0]


def test_many_places_are_told_as_one_by_one_in_any_order_of_the_others(found) -> None:
    """Near and far from three objects and the walls, against the distances of all points."""
    one = Neighbour.of(found.box((0.0, 0.0), (0.05, 0.03), 0.3))
    others = [
        Neighbour.of(c)
        for c in (found.round((0.06, 0.1), 0.03), found.box((0.05, -0.1), (0.08, 0.04), 0.4), found.round((0, 0), 0.02))
    ]
    shifts = np.random.default_rng(0).uniform(-HALF, HALF, (400, 2))
    for gap in (0.0, 0.012, 0.028):
        got = keeps_gap(one, shifts, gap, others, HALF)
        assert 20 < got.sum() < 380
        np.testing.assert_array_equal(got, keeps_gap(one, shifts, gap, others[::-1], HALF))
        for shift, free in zip(shifts, got, strict=True):
            there = one.moved(shift)
            assert free == (min(wall_gap_m(there, HALF), *(gap_m(there, other) for other in others)) >= gap)


def test_the_neighbour_that_blocks_the_fingers_is_taken_out_and_makes_space(found) -> None:
    wide = found.box((0.0, -0.10), (0.12, 0.05), index=0)  # only its long sides fit between the jaws
    blocking = found.box((0.0, -0.045), (0.05, 0.04), index=1)  # 10 mm beside one of them
    elsewhere = found.round((0.10, 0.15), 0.02, index=2)
    things = (wide, blocking, elsewhere)
    assert finger_space_m(wide, [Neighbour.of(c) for c in things[1:]], HALF, GRIPPER) < NEEDED_M
    clearing = last(ClearPlanner(things, HALF, GRIPPER).for_space(wide))
    assert clearing is not None
    assert clearing.grasp.candidate == 1
    assert clearing.space_m >= NEEDED_M
    there = stands_at(clearing.places[0], blocking)
    around = [Neighbour.of(c) for c in (there, elsewhere)]
    assert finger_space_m(wide, around, HALF, GRIPPER) == pytest.approx(clearing.space_m, abs=1e-3)


@pytest.mark.parametrize("yaw_deg", [0, 30, 75])
def test_every_place_is_free_by_an_independent_measure(found, yaw_deg: float) -> None:
    moving = found.box((-0.08, -0.10), (0.06, 0.04), math.radians(yaw_deg), index=0)
    others = (found.round((0.06, 0.1), 0.03, index=1), found.box((0.05, -0.1), (0.08, 0.04), 0.4, index=2))
    clearing = last(ClearPlanner((moving, *others), HALF, GRIPPER).take_out(moving))
    assert clearing is not None
    assert len(clearing.places) > 1
    for place in clearing.places:
        there = stands_at(place, moving)
        np.testing.assert_allclose(there.contour.centre_K_m, moving.contour.centre_K_m + place.shift_K_m, atol=1e-9)
        points = there.extent_K_m
        assert (HALF - np.abs(points)).min() >= place.gap_m - 1e-9
        for other in others:
            assert signed_distance(other.contour, points).min() >= place.gap_m - 1e-9
            assert signed_distance(there.contour, other.extent_K_m).min() >= place.gap_m - 1e-9
        assert signed_distance(moving.contour, points).min() >= -1e-9  # it leaves its place


def test_the_nearest_place_is_chosen(found) -> None:
    """A disc alone, far from the walls, has to leave its own place: two radii, to the spacing of the places tried."""
    disc = found.round((0.0, 0.0), 0.02)
    clearing = last(ClearPlanner((disc,), HALF, GRIPPER).take_out(disc))
    assert clearing is not None
    diameter = disc.contour.size_m[0]
    shifts = [float(np.linalg.norm(p.shift_K_m)) for p in clearing.places]
    assert diameter <= shifts[0] <= diameter + math.sqrt(2.0) * GRID_M
    assert shifts == sorted(shifts)
    assert clearing.places[0].gap_m == GAPS_M[0]


def test_obstacles_are_kept_clear(found) -> None:
    disc = found.round((0.0, -0.1), 0.02)
    wall = Neighbour.of(found.box((0.0, 0.0), (0.28, 0.04), index=9))
    clearing = last(ClearPlanner((disc,), HALF, GRIPPER, (wall,)).take_out(disc))
    assert clearing is not None
    for place in clearing.places:
        assert keeps_gap(Neighbour.of(disc), place.shift_K_m[None], GAPS_M[-1] - 1e-9, [wall], HALF)[0]


def test_a_full_box_has_no_place(found) -> None:
    disc = found.round((0.0, -0.12), 0.025)
    full = [found.box((0.0, 0.07), (0.28, 0.24)), *(found.box((x, -0.12), (0.11, 0.14)) for x in (-0.095, 0.095))]
    assert last(ClearPlanner((disc,), HALF, GRIPPER, [Neighbour.of(c) for c in full]).take_out(disc)) is None


def test_nothing_is_taken_out_that_gains_nothing(found) -> None:
    things = (found.round((0.0, 0.0), 0.02, index=0), found.round((0.06, 0.14), 0.02, index=1))
    assert last(ClearPlanner(things, HALF, GRIPPER).for_space(things[0])) is None


def test_an_object_is_taken_out_itself_where_only_a_wall_is_in_the_way(found) -> None:
    """No neighbour is near, so none can be taken out; away from the wall, the fingers fit on every side."""
    at_wall = found.box((0.0, 0.17), (0.06, 0.04))
    clearing = last(ClearPlanner((at_wall,), HALF, GRIPPER).for_space(at_wall))
    assert clearing is not None
    assert clearing.grasp.candidate == 0
    there = stands_at(clearing.places[0], at_wall)
    assert finger_space_m(there, [], HALF, GRIPPER) >= clearing.space_m >= 0.0
    assert not cramped_stances(there, [], HALF, GRIPPER).any()
