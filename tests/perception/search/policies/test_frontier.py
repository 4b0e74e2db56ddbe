import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.perception.search import NearestFrontier, Routes, SearchMap, segment_is_free
from glotouch_bt.perception.search.policies.frontier import PAPER_PASSES
from glotouch_bt.perception.touch import Contour
from glotouch_bt.robot import ParamError
from tests.support.examples import examples
from tests.support.swept_area import covered_fraction

HALF = np.array([0.188, 0.138])
CORNER = np.array([-0.18, -0.13])


def next_path(policy, belief, tip):
    stretch = policy.next_stretch(belief, tip)
    return None if stretch is None else stretch.waypoints_K_m


def layouts(planar, n):
    return [planar.random_layout(np.random.default_rng(1000 + i)) for i in range(n)]


@pytest.mark.parametrize("count", [10, pytest.param(30, marks=pytest.mark.study)])
def test_all_objects_are_touched_within_three_metres(planar, count):
    """Random layouts of five objects; travel counts sweeps and orbits. The paper: 3.30 at 3 m, 55 % complete at 5 m."""
    trials = [planar.run(NearestFrontier(seed=i), w, CORNER) for i, w in enumerate(layouts(planar, count))]
    (_, _), (at_3, complete_3), (_, complete_5) = planar.summary(trials)
    assert at_3 > 4.8
    assert complete_3 >= 0.9
    assert complete_5 == 1.0


@pytest.mark.parametrize("count", [6, pytest.param(20, marks=pytest.mark.study)])
def test_the_paper_s_own_policy_completes_less(planar, count):
    """The single pass, for the ablation: still complete at 5 m in this idealised plane, but later."""
    worlds = layouts(planar, count)
    ours = [planar.run(NearestFrontier(seed=i), w, CORNER) for i, w in enumerate(worlds)]
    paper = [
        planar.run(NearestFrontier(seed=i, passes=PAPER_PASSES, turn_m=0.0), w, CORNER) for i, w in enumerate(worlds)
    ]
    assert np.mean([t.sweep for t in ours]) < 0.8 * np.mean([t.sweep for t in paper])


def test_empty_container_is_exhausted(planar):
    """Nothing inside: the search ends, having come within the coverage radius of everything."""
    ghost = Contour("round", np.array([5.0, 5.0]), (0.04, 0.04), 0.0, 0.0, np.zeros(0))
    policy = NearestFrontier(passes=PAPER_PASSES)
    trial = planar.run(policy, [(ghost, None)], CORNER, limit_m=30.0)
    assert trial.exhausted
    assert len(policy.frontiers(trial.belief)) == 0
    assert covered_fraction(trial.belief, 1.3 * 0.024) > 0.99


def test_full_map_is_exhausted_at_once():
    full = Contour("box", np.zeros(2), (0.15, 0.15), 0.0, 0.0, np.zeros(0))
    belief = SearchMap.blank(HALF, 3).with_exclusion(full, 0.2)
    assert NearestFrontier().next_stretch(belief, CORNER) is None


def test_the_nearest_frontier_is_taken():
    """Without exclusions, by brute force."""
    policy = NearestFrontier(passes=PAPER_PASSES, turn_m=0.0)
    belief = SearchMap.blank(HALF, 1).with_path([CORNER, [0.1, -0.13]])
    tip = np.array([0.1, -0.13])
    left = policy.frontiers(belief)
    want = left[np.argmin(np.linalg.norm(left - tip, axis=1))]
    np.testing.assert_allclose(next_path(policy, belief, tip), want[None])


def test_unreachable_frontiers_are_left_out():
    """A wall of excluded envelopes from side to side: nothing beyond it is proposed."""
    wall = Contour("box", np.zeros(2), (0.15, 0.02), np.pi / 2 - 1e-9, 0.0, np.zeros(0))
    belief = SearchMap.blank(HALF, 9)
    for y in (-0.1, 0.1):
        belief = belief.with_exclusion(Contour("box", np.array([0.0, y]), *_rest(wall)), 0.03)
    policy, tip = NearestFrontier(), CORNER
    for _ in range(200):
        way = next_path(policy, belief, tip)
        if way is None:
            break
        assert (way[:, 0] < 0).all()
        belief, tip = belief.with_path(np.vstack([tip, way])), way[-1]
    assert way is None


def _rest(c):
    return c.size_m, c.yaw_rad, c.rms_m, c.residuals_m


def test_dropped_places_are_not_tried_again():
    policy, belief = NearestFrontier(), SearchMap.blank(0.5 * HALF, 1)
    for _ in range(3000):
        way = next_path(policy, belief, 0.5 * CORNER)
        if way is None:
            break
        belief = belief.with_dropped(way[-1])
    assert way is None


def test_deterministic():
    belief = SearchMap.blank(HALF, 5).with_path([CORNER, [0.0, 0.0]])
    a, b = (next_path(NearestFrontier(seed=3), belief, np.zeros(2)) for _ in range(2))
    np.testing.assert_array_equal(a, b)


contour = st.builds(
    lambda kind, x, y, long, ratio, yaw: Contour(
        kind, np.array([x, y]), (long, long if kind == "round" else ratio * long), yaw, 0.0, np.zeros(0)
    ),
    st.sampled_from(["round", "box"]),
    st.floats(-0.15, 0.15),
    st.floats(-0.1, 0.1),
    st.floats(0.03, 0.11),
    st.floats(0.3, 1.0),
    st.floats(-1.5, 1.5),
)


@settings(deadline=None, max_examples=examples(25, 60), derandomize=True)
@given(st.lists(contour, min_size=1, max_size=5), st.floats(-1, 1), st.floats(-1, 1), st.integers(0, 5))
def test_no_route_enters_an_exclusion(contours, x, y, seed):
    belief, tip = SearchMap.blank(HALF, 9), HALF * [x, y]
    for c in contours:
        belief = belief.with_exclusion(c, 0.01)
    started_inside = bool(belief.inside_exclusion(tip[None])[0])
    way = next_path(NearestFrontier(seed=seed), belief, tip)
    if way is None:
        return
    points = np.vstack([tip, way])
    assert belief.inside_extent(points[1:]).all()
    for a, b in list(itertools.pairwise(points))[int(started_inside) :]:
        dense = a + (b - a) * np.linspace(0, 1, 2000)[:, None]
        assert belief.clearance(dense).min() > -1e-4


def test_route_round_a_disc_is_near_the_shortest():
    """Two tangents and an arc: the closed form for a disc in the way."""
    radius = 0.05
    disc = Contour("round", np.zeros(2), (2 * radius - 0.02,) * 2, 0.0, 0.0, np.zeros(0))
    belief = SearchMap.blank(HALF, 9).with_exclusion(disc, 0.01)
    start, goal = np.array([-0.12, 0.001]), np.array([0.12, 0.001])
    assert not segment_is_free(belief, start, goal)
    routes = Routes(belief, start)
    way = np.vstack([start, routes.to(goal)])
    got = np.sum(np.linalg.norm(np.diff(way, axis=0), axis=1))
    tangent = np.sqrt(0.12**2 - radius**2)
    want = 2 * tangent + radius * (np.pi - 2 * np.arccos(radius / 0.12))
    assert want - 1e-3 < got < 1.06 * want
    assert routes.lengths(goal[None])[0] == pytest.approx(want, rel=0.08)
    assert routes.to(np.zeros(2)) is None


@pytest.mark.parametrize("bad", [{"coverage_radius_m": 0.0}, {"samples": 0}, {"passes": ()}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(ParamError):
        NearestFrontier(**bad)
