"""Calibration, separation and clustered rates against what can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.bench.scores import (
    auroc,
    calibration_error,
    reliability,
    shared_auroc,
    shared_calibration,
    shared_rate,
)


def test_calibration_error_worked_by_hand():
    """Bin (.6, .7]: mean .65, 1 of 2 right. Bin (.9, 1]: mean .95, 3 of 4 right. (2 x .15 + 4 x .20) / 6."""
    p = [0.62, 0.68, 0.92, 0.94, 0.96, 0.98]
    right = [1, 0, 1, 1, 1, 0]
    assert calibration_error(p, right) == pytest.approx((2 * 0.15 + 4 * 0.2) / 6)
    bins = reliability(p, right)
    assert [(b["lo"], b["n"], b["right"]) for b in bins] == [(0.6, 2, 0.5), (0.9, 4, 0.75)]


def test_edges_belong_to_the_bin_below():
    found = reliability([0.0, 0.1, 0.1000001, 1.0], [0, 0, 1, 1])
    assert [(b["lo"], b["n"]) for b in found] == [(0.0, 2), (0.1, 1), (0.9, 1)]


def test_a_coin_that_says_so_is_calibrated():
    """p drawn evenly and right with just that probability: only sampling noise is left, about sqrt(p q / n_bin)."""
    rng = np.random.default_rng(3)
    p = rng.random(200_000)
    assert calibration_error(p, rng.random(p.size) < p) < 0.005
    assert calibration_error(p, rng.random(p.size) < p**2) == pytest.approx(1 / 2 - 1 / 3, abs=0.005)


def test_calibration_error_of_nothing_is_nothing():
    assert np.isnan(calibration_error([], []))
    assert reliability([], []) == []


@given(
    st.lists(st.integers(-3, 3), min_size=1, max_size=12),
    st.lists(st.integers(-3, 3), min_size=1, max_size=12),
)
def test_auroc_is_the_share_of_pairs_in_order(positive, negative):
    pairs = [1.0 if a > b else 0.5 if a == b else 0.0 for a in positive for b in negative]
    assert auroc(positive, negative) == pytest.approx(np.mean(pairs))


def test_auroc_of_two_normals():
    """P(N(d, 1) > N(0, 1)) = Phi(d / sqrt 2) = 0.7602 for d = 1."""
    a, b = np.random.default_rng(0).normal(size=(2, 50_000))
    assert auroc(a + 1.0, b) == pytest.approx(0.7602, abs=0.005)


def test_auroc_of_infinite_and_missing_scores():
    assert auroc([np.inf, 1.0], [-np.inf, np.nan]) == 1.0
    assert np.isnan(auroc([], [1.0]))


def test_trials_of_a_layout_are_not_independent():
    """Ten layouts of five trials that all agree: the interval over layouts is that of ten trials, not of fifty."""
    right = [k < 8 for k in range(10) for _ in range(5)]
    found = shared_rate(right, [k for k in range(10) for _ in range(5)])
    assert (found["rate"], found["n"]) == (0.8, 50)
    assert found["whole_layouts"]["n"] == 10
    assert found["whole_layouts"]["rate"] == 0.8
    se = np.sqrt(0.8 * 0.2 / 10)
    assert found["by_layout"]["lo"] == pytest.approx(0.8 - 1.96 * se, abs=0.06)
    assert found["hi"] - found["lo"] < 0.6 * (found["by_layout"]["hi"] - found["by_layout"]["lo"])


def test_independent_trials_need_no_layouts():
    """One trial a layout: the bootstrap is the ordinary one, about the normal interval of a rate."""
    right = np.arange(200) % 4 != 0
    found = shared_rate(right, np.arange(200))["by_layout"]
    half = 1.96 * np.sqrt(0.75 * 0.25 / 200)
    assert (found["lo"], found["hi"]) == pytest.approx((0.75 - half, 0.75 + half), abs=0.015)
    assert found["layouts"] == 200


def test_no_trials():
    found = shared_rate([], [])
    assert found["n"] == 0
    assert np.isnan(found["rate"])
    assert found["by_layout"]["layouts"] == 0


def drawn_again(statistic, layout, resamples=400):
    """The plain way to the same interval: layouts drawn, their trials gathered, the statistic taken anew."""
    rng = np.random.default_rng(1)
    names = np.unique(layout)
    places = [np.flatnonzero(layout == n) for n in names]
    drawn = (rng.integers(0, len(names), len(names)) for _ in range(resamples))
    values = np.array([statistic(np.concatenate([places[i] for i in d])) for d in drawn])
    return np.percentile(values[np.isfinite(values)], [2.5, 97.5])


def test_intervals_are_those_of_the_plain_bootstrap():
    rng = np.random.default_rng(5)
    layout = np.repeat(np.arange(12), 5)
    shift = rng.normal(size=12)[layout]
    score, there = rng.normal(size=60) + 0.5 * shift, rng.random(60) < 0.5
    score += there
    found = shared_auroc(score[there], score[~there], (layout[there], layout[~there]))
    plain = drawn_again(lambda k: auroc(score[k][there[k]], score[k][~there[k]]), layout)
    assert found["value"] == auroc(score[there], score[~there])
    assert (found["lo"], found["hi"]) == pytest.approx(tuple(plain), abs=0.03)
    p, right = rng.random(60), there
    found = shared_calibration(p, right, layout)
    plain = drawn_again(lambda k: calibration_error(p[k], right[k]), layout)
    assert found["value"] == calibration_error(p, right)
    assert (found["lo"], found["hi"]) == pytest.approx(tuple(plain), abs=0.03)
