"""Expected undiscovered objects, and the path to them, against closed forms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.perception.search import ExpectationParams, ExpectedFind, SearchMap
from glotouch_bt.perception.search.policies.expectation import COLUMN_M, SLACK_M, _find, _Hidden, _lattice
from glotouch_bt.perception.search.remaining import USUAL
from glotouch_bt.perception.touch import Contour

HALF = np.array([0.138, 0.188])
PARAMS = ExpectationParams()
POLICY = ExpectedFind()
coordinate = st.floats(-0.2, 0.2)


def blank() -> SearchMap:
    return SearchMap.blank(HALF, expected=5)


def weights(belief: SearchMap) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres, radii and weights of hidden discs."""
    left = belief.hidden
    return left.discs.centre, left.discs.radius, left.weight


def serpentine(upto_m: float, apart_m: float = 0.02) -> np.ndarray:
    rows = np.arange(-HALF[1], upto_m + 1e-9, apart_m)
    x = np.tile([-HALF[0], HALF[0], HALF[0], -HALF[0]], len(rows))[: 2 * len(rows)]
    return np.column_stack([x, np.repeat(rows, 2)])


def test_before_any_search_the_weights_are_a_distribution_over_discs_that_fit() -> None:
    centre, radius, weight = weights(blank())
    assert weight.sum() == pytest.approx(1.0)
    inner = HALF + USUAL.wall_m
    assert np.all(np.abs(centre) + radius[:, None] <= inner + 1e-9)
    for r in USUAL.radii_m:  # every size as likely
        assert weight[radius == r].sum() == pytest.approx(1.0 / len(USUAL.radii_m))


def found_on(discs: _Hidden, left: np.ndarray, start: np.ndarray, end: np.ndarray, *, take: bool) -> np.ndarray:
    """Weight found on legs, all with the first row of what is left."""
    rows = np.zeros(len(start), dtype=np.int64)
    return _find(discs.centre, discs.reach, discs.first, discs.west_m, left, rows, start, end, take)


@settings(max_examples=30, deadline=None)
@given(st.tuples(coordinate, coordinate), st.tuples(coordinate, coordinate), st.floats(0.005, 0.05))
def test_a_leg_finds_the_discs_that_it_comes_near(a: tuple[float, float], b: tuple[float, float], reach: float) -> None:
    """Against the distances from a finely sampled line."""
    start, end = np.array(a), np.array(b)
    line = start + np.linspace(0, 1, 2001)[:, None] * (end - start)
    centre = np.random.default_rng(0).uniform(-0.2, 0.2, (200, 2))
    discs = _Hidden.sorted(centre, np.full(200, reach), np.ones(200))
    distance = np.linalg.norm(discs.centre[:, None] - line[None], axis=2).min(axis=1)
    clear = np.abs(distance - reach) > 2e-4  # of what is nearer the sampled line says nothing
    left = discs.weight[None].copy()
    found = found_on(discs, left, start[None], end[None], take=True)
    np.testing.assert_array_equal(left[0, clear] == 0.0, (distance < reach)[clear])
    assert found[0] == np.count_nonzero(left == 0.0)


def test_weight_is_found_once_and_only_in_its_own_row() -> None:
    centre, reach = np.array([[0.0, 0.0], [0.1, 0.0]]), np.array([0.02, 0.02])
    discs = _Hidden.sorted(centre, reach, np.array([0.25, 0.5]))
    left = np.repeat(discs.weight[None], 2, axis=0)
    start, end = np.array([[0.0, 0.0]]), np.array([[0.2, 0.0]])
    assert found_on(discs, left, start, end, take=False)[0] == 0.75
    assert found_on(discs, left, start, end, take=True)[0] == 0.75
    assert found_on(discs, left, start, end, take=True)[0] == 0.0
    np.testing.assert_array_equal(left, [[0.0, 0.0], [0.25, 0.5]])


def test_without_discs_nothing_is_found() -> None:
    discs = _Hidden.sorted(np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    start, end = np.array([[0.0, 0.0]]), np.array([[0.2, 0.0]])
    assert found_on(discs, np.zeros((1, 0)), start, end, take=True)[0] == 0.0


def test_discs_outside_the_region_of_the_paths_are_left_out_and_no_others() -> None:
    every = blank().hidden
    low, high = np.array([-0.05, -0.02]), np.array([0.01, 0.06])
    some = _Hidden.of(every.discs, every.weight, low, high)
    away = np.linalg.norm(np.maximum(np.maximum(low - every.discs.centre, every.discs.centre - high), 0.0), axis=1)
    assert some.weight.sum() >= every.weight[away < every.discs.reach - SLACK_M].sum()
    assert len(some.weight) < np.count_nonzero(every.weight)
    assert np.ptp(some.centre[some.first[0] : some.first[1], 0]) <= COLUMN_M
    assert np.all(np.diff(some.centre[some.first[0] : some.first[1], 1]) >= 0.0)


def test_a_leg_and_its_reverse_have_one_track() -> None:
    lattice = _lattice((0.05, 0.08), PARAMS)
    ends = {tuple(e): track for e, track in zip(lattice.ends.tolist(), lattice.track.tolist(), strict=True)}
    assert all(ends[b, a] == track for (a, b), track in ends.items())
    assert len(set(ends.values())) == len(ends) // 2


def test_a_disc_the_path_swept_over_is_ruled_out_and_no_other() -> None:
    way = np.array([[-0.1, -0.05], [0.08, 0.12]])
    before = weights(blank())[2]
    centre, radius, weight = weights(blank().with_path(way))
    d = way[1] - way[0]  # the map keeps a point every 2 mm of it
    t = np.clip(((centre - way[0]) @ d) / (d @ d), 0.0, 1.0)
    distance = np.linalg.norm(centre - way[0] - t[:, None] * d, axis=1)
    reach = USUAL.touch * (radius + USUAL.tip_radius_m)
    assert np.all(weight[distance < reach - 2.1e-3] == 0.0)
    np.testing.assert_array_equal(weight[distance > reach + 2.1e-3], before[distance > reach + 2.1e-3])


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.floats(-0.138, 0.138), st.floats(-0.188, 0.188)), min_size=2, max_size=8))
def test_hidden_mass_only_falls(places: list[tuple[float, float]]) -> None:
    belief, last = blank(), 1.0
    for a, b in pairwise(places):
        belief = belief.with_path([a, b])
        mass = float(weights(belief)[2].sum())
        assert mass <= last + 1e-12
        last = mass


def test_nothing_is_hidden_inside_a_traced_object_and_little_beside_it() -> None:
    disc = Contour("round", np.array([0.0, 0.0]), (0.06, 0.06), 0.0, 0.0, np.zeros(0))
    before = weights(blank())[2]
    centre, radius, weight = weights(blank().with_exclusion(disc, 0.01))
    gap = np.linalg.norm(centre, axis=1) - 0.03 - radius
    assert np.all(weight[gap < -1e-9] == 0.0)
    near = (gap > 1e-9) & (gap < USUAL.gap_m - 1e-9)
    np.testing.assert_allclose(weight[near], USUAL.gap_weight * before[near])
    np.testing.assert_array_equal(weight[gap > USUAL.gap_m + 1e-9], before[gap > USUAL.gap_m + 1e-9])


def test_it_goes_where_nobody_has_been() -> None:
    """All below y = 80 mm is known: what finds anything leads up."""
    belief = blank().with_path(serpentine(0.08))
    way = POLICY.next_stretch(belief, belief.path_K_m[-1])
    assert way is not None
    assert way.waypoints_K_m[-1, 1] > 0.08
    assert not way.raised


def test_when_all_is_known_it_ends() -> None:
    """Rows that are farther apart leave gaps in which something small may stand."""
    wide, narrow = (blank().with_path(serpentine(HALF[1], 2.0 * HALF[1] / rows)) for rows in (10, 20))
    for belief in (wide, narrow):
        assert float(weights(belief)[2].sum()) < PARAMS.left
    assert wide.any_size.share > 0.01
    assert POLICY.next_stretch(wide, wide.path_K_m[-1]) is not None
    assert POLICY.next_stretch(narrow, narrow.path_K_m[-1]) is None


def test_the_same_question_has_the_same_answer() -> None:
    belief = blank().with_path(serpentine(0.0))
    one, two = (ExpectedFind().next_stretch(belief, np.array([0.0, 0.0])) for _ in range(2))
    assert one is not None
    assert two is not None
    np.testing.assert_array_equal(one.waypoints_K_m, two.waypoints_K_m)
