"""The chance that something is left, against closed forms and against random worlds drawn from the prior."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.perception.search import SearchMap, chance_left, left_in_words
from glotouch_bt.perception.search.remaining import ANY, DENSITY_PER_M2
from glotouch_bt.perception.touch import Contour

HALF = np.array([0.138, 0.188])
INNER = HALF + ANY.wall_m
FLOOR_M2 = float(np.prod(2 * INNER))
MEAN = DENSITY_PER_M2 * FLOOR_M2
Q = MEAN / (1 + MEAN)
DISC = Contour("round", np.array([0.03, 0.02]), (0.06, 0.06), 0.0, 0.0, np.zeros(0))
place = st.tuples(st.floats(-HALF[0], HALF[0]), st.floats(-HALF[1], HALF[1]))


def blank() -> SearchMap:
    return SearchMap.blank(HALF, expected=None)


def rows(apart_m: float, upto_m: float = HALF[1]) -> np.ndarray:
    """Rows from wall to wall."""
    ys = np.append(np.arange(-HALF[1], upto_m, apart_m), upto_m)
    x = np.tile([-HALF[0], HALF[0], HALF[0], -HALF[0]], len(ys))[: 2 * len(ys)]
    return np.column_stack([x, np.repeat(ys, 2)])


@pytest.mark.parametrize("found", [0, 1, 5, 8])
@pytest.mark.parametrize("share", [0.001, 0.02, 0.3, 0.9])
def test_the_closed_form_is_the_sum_over_the_number_of_objects(found: int, share: float) -> None:
    term, terms = Q**found, [Q**found]
    for m in range(1, 4000):  # p(k + m) C(k + m, m) h^m
        term *= Q * share * (found + m) / m
        terms.append(term)
    assert chance_left(share, found, FLOOR_M2) == pytest.approx(1 - terms[0] / sum(terms), abs=1e-9)


def test_the_chance_is_the_frequency_in_worlds_of_the_prior() -> None:
    """Numbers drawn from the prior, each object missed with probability h, and counted by the number found."""
    rng, share = np.random.default_rng(0), 0.1
    number = rng.geometric(1 - Q, size=400_000) - 1
    missed = rng.binomial(number, share)
    for found in range(8):
        mine = number - missed == found
        sd = 0.5 / np.sqrt(mine.sum())
        assert chance_left(share, found, FLOOR_M2) == pytest.approx(np.mean(missed[mine] > 0), abs=4 * sd)


def test_the_share_is_the_frequency_of_discs_that_the_path_does_not_touch() -> None:
    """Discs of the prior at random places, anywhere where they fit beside a traced object."""
    rng, belief = np.random.default_rng(1), blank().with_exclusion(DISC, 0.01).with_path(rows(0.05, 0.1))
    a, b = rows(0.05, 0.1)[:-1], rows(0.05, 0.1)[1:]
    shares = []
    for r in ANY.radii_m:
        centre = rng.uniform(-1, 1, (20_000, 2)) * (INNER - r)
        centre = centre[np.linalg.norm(centre - DISC.centre_K_m, axis=1) > 0.03 + r]
        t = np.clip(((centre[:, None] - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1), 0, 1)
        away = np.linalg.norm(centre[:, None] - a - t[..., None] * (b - a), axis=-1).min(axis=1)
        shares.append(np.mean(away >= ANY.touch * (r + ANY.tip_radius_m)))
    assert belief.hidden.share == pytest.approx(np.mean(shares), abs=0.01)


def test_before_any_search_it_is_the_prior() -> None:
    assert blank().chance_left == pytest.approx(Q)
    assert chance_left(1.0, 0, FLOOR_M2) == pytest.approx(Q)
    one = blank().with_exclusion(DISC, 0.01)
    assert one.hidden.share == pytest.approx(1.0), "beside a traced object everything may still be"
    assert one.chance_left == pytest.approx(1 - (1 - Q) ** 2)


def test_an_obstacle_hides_nothing() -> None:
    """It is only the place of a contact with a traced object."""
    belief = blank().with_exclusion(DISC, 0.01)
    assert belief.with_obstacle((-0.06, -0.08), 0.012).hidden.share == pytest.approx(belief.hidden.share)


def test_when_all_is_swept_nothing_is_left() -> None:
    belief = blank().with_path(rows(0.01))
    assert (belief.chance_left, belief.complete) == (0.0, True)
    assert chance_left(0.0, 7, FLOOR_M2) == 0.0


def test_between_wide_rows_only_small_objects_hide() -> None:
    left = blank().with_path(rows(0.033)).hidden
    assert set(left.discs.radius[left.weight > 0]) == {0.0088}
    assert 0.0 < left.share < 1 / len(ANY.radii_m)


@settings(max_examples=15, deadline=None)
@given(st.lists(place, min_size=2, max_size=6))
def test_it_only_falls_along_a_path(places: list[tuple[float, float]]) -> None:
    belief, last = blank(), 1.0
    for at in places:
        belief = belief.with_path([(0.0, 0.0), at])
        assert belief.chance_left <= last
        last = belief.chance_left


@given(st.floats(0.001, 0.999), st.integers(0, 15))
def test_the_more_were_found_the_more_are_expected(share: float, found: int) -> None:
    assert 0 < chance_left(share, found, FLOOR_M2) < chance_left(share, found + 1, FLOOR_M2) <= 1


def test_in_words() -> None:
    assert left_in_words(0.0483) == "chance that an object of at least 15 mm is left: 4.8 %"
    assert left_in_words(0.0).endswith("below 0.1 %")
    assert left_in_words(float("nan")) == "", "a known number needs no words"
