"""The policy for an unknown number of objects: it covers the floor, gaps between sweeps included."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.search import SearchMap, search_policy
from glotouch_bt.perception.search.policies.hidden import MIN_GAIN, gains
from glotouch_bt.perception.touch import Contour
from tests.perception.search.test_remaining import HALF, blank, rows

POLICY = search_policy("expected_find")
DISC = Contour("round", np.array([0.03, 0.02]), (0.06, 0.06), 0.0, 0.0, np.zeros(0))


def test_it_goes_into_the_gap_between_two_sweeps() -> None:
    """Rows 20 mm apart, but two are missing: only what is small can be there."""
    upper = rows(0.02)[rows(0.02)[:, 1] > -0.010]
    belief = blank().with_path(rows(0.02, -0.05)).with_path(upper)
    stretch = POLICY.next_stretch(belief, np.array([0.0, 0.05]))
    assert stretch is not None
    assert -0.05 < stretch.waypoints_K_m[-1, 1] < -0.008


def test_it_covers_the_floor_and_ends_when_no_reachable_place_would_touch_anything() -> None:
    belief, tip, travel_m, enough_m = blank().with_exclusion(DISC, 0.01), np.array([-0.1, -0.15]), 0.0, 0.0
    while (stretch := POLICY.next_stretch(belief, tip)) is not None:
        way = np.vstack([tip, stretch.waypoints_K_m])
        assert not belief.inside_exclusion(way[1:]).any()
        assert belief.inside_extent(way).all()
        travel_m += float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
        belief, tip = belief.with_path(way), way[-1]
        enough_m = enough_m or travel_m * belief.complete
        assert travel_m < 20.0, "it does not end"
    assert gains(belief)[1].max() <= MIN_GAIN
    assert 0.0 < enough_m < 7.0, "coverage of 0.11 m2 by swaths of 23 mm is 4.9 m"


def test_the_search_ends_when_no_disc_of_the_prior_fits_between_the_rows() -> None:
    """The smallest disc has a radius of 8.8 mm: the ball touches it from rows up to 29.6 mm apart."""
    for expected in (5, None):
        belief = SearchMap.blank(HALF, expected).with_path(rows(0.0275))
        assert POLICY.next_stretch(belief, belief.path_K_m[-1]) is None
    unknown = blank().with_path(rows(0.033))
    assert POLICY.next_stretch(unknown, unknown.path_K_m[-1]) is not None
