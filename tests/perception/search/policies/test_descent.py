"""The paper's baseline without a search."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.perception.search import SearchMap, search_policy
from glotouch_bt.perception.search.policies.descent import RandomDescent
from glotouch_bt.perception.touch import Contour
from glotouch_bt.robot import ParamError

HALF = (0.14, 0.19)
DISC = Contour("round", np.array([0.02, 0.03]), (0.07, 0.07), 0.0, 0.0, np.zeros(0))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_a_descent_is_raised_inside_the_container_and_outside_what_is_traced(seed: int) -> None:
    belief = SearchMap.blank(HALF, 5).with_exclusion(DISC, 0.01)
    stretch = RandomDescent(seed).next_stretch(belief, np.zeros(2))
    assert stretch is not None
    assert stretch.raised
    assert stretch.waypoints_K_m.shape == (1, 2)
    assert belief.inside_extent(stretch.waypoints_K_m).all()
    assert not belief.inside_exclusion(stretch.waypoints_K_m).any()


def test_places_are_uniform_over_the_region() -> None:
    """Each quarter gets its share, within four standard deviations of a binomial."""
    belief = SearchMap.blank(HALF, 5)
    n = 2000
    places = np.array([RandomDescent(s).next_stretch(belief, np.array([9.0, 9.0])).waypoints_K_m[0] for s in range(n)])
    quarter = (places[:, 0] > 0).astype(int) + 2 * (places[:, 1] > 0)
    assert np.abs(np.bincount(quarter, minlength=4) - n / 4).max() < 4 * np.sqrt(n * 0.25 * 0.75)
    assert np.abs(places).max(axis=0) == pytest.approx(HALF, rel=0.02)


def test_it_goes_elsewhere_once_the_map_has_grown_and_answers_alike_for_the_same_map() -> None:
    policy, belief, tip = RandomDescent(1), SearchMap.blank(HALF, 5), np.zeros(2)
    first = policy.next_stretch(belief, tip).waypoints_K_m
    assert (policy.next_stretch(belief, tip).waypoints_K_m == first).all()
    descended = policy.next_stretch(belief.with_path(first), first[0]).waypoints_K_m
    dropped = policy.next_stretch(belief.with_dropped(first[0]), tip).waypoints_K_m
    assert len({tuple(p[0]) for p in (first, descended, dropped)}) == 3


def test_it_gives_up_after_so_many_descents() -> None:
    policy, belief, tip = RandomDescent(max_descents=12), SearchMap.blank(HALF, 5), np.zeros(2)
    count = 0
    while (stretch := policy.next_stretch(belief, tip)) is not None:
        tip = stretch.waypoints_K_m[-1]
        belief = belief.with_path(tip[None])
        count += 1
    assert count in (12, 13)  # the first descent has no hop before it


def test_nothing_left_outside_what_is_traced() -> None:
    everything = Contour("round", np.zeros(2), (1.0, 1.0), 0.0, 0.0, np.zeros(0))
    belief = SearchMap.blank(HALF, 5).with_exclusion(everything, 0.0)
    assert RandomDescent().next_stretch(belief, np.zeros(2)) is None


def test_missions_call_it_by_name() -> None:
    assert isinstance(search_policy("random_descent"), RandomDescent)


def test_no_descents_is_refused() -> None:
    with pytest.raises(ParamError):
        RandomDescent(max_descents=0)
