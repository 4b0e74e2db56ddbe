"""Paired statistics against closed forms and scipy's own paired tests."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from glotouch_bt.bench.compare import mcnemar, paired_mean, paired_rate


@pytest.mark.parametrize("seed", range(20))
def test_one_trial_a_world_is_the_paired_t_test(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 40))
    a, b = rng.normal(10, 3, n), rng.normal(11, 3, n)
    found = paired_mean(a, b, [str(i) for i in range(n)])
    test = stats.ttest_rel(b, a)
    interval = test.confidence_interval(0.95)
    assert (found["lo"], found["hi"], found["p"]) == pytest.approx((interval.low, interval.high, test.pvalue))
    assert found["difference"] == pytest.approx(b.mean() - a.mean())


def test_trials_of_a_world_count_once() -> None:
    """Two worlds with differences 1 and 3, however often they are tried: mean 2, t(1) = 12.706, sd / sqrt(2) = 1."""
    a = np.zeros(12)
    b = np.array([1.0] * 10 + [3.0] * 2)
    found = paired_mean(a, b, ["x"] * 10 + ["y"] * 2)
    assert (found["difference"], found["n"], found["worlds"]) == (2.0, 12, 2)
    assert (found["lo"], found["hi"]) == pytest.approx((2 - 12.7062, 2 + 12.7062), abs=1e-3)


def test_worlds_that_agree_have_an_interval_without_width() -> None:
    same = paired_mean([1.0, 2.0], [1.0, 2.0], ["x", "y"])
    assert (same["difference"], same["lo"], same["hi"], same["p"]) == (0.0, 0.0, 0.0, 1.0)
    shifted = paired_mean([1.0, 2.0], [2.0, 3.0], ["x", "y"])
    assert (shifted["lo"], shifted["hi"], shifted["p"]) == (1.0, 1.0, 0.0)
    assert math.isnan(paired_mean([1.0], [2.0], ["x"])["lo"])


def test_coverage_of_the_interval_over_worlds() -> None:
    """Trials share the effect of their world; about 95 % of the intervals hold the true difference of 1."""
    rng, inside = np.random.default_rng(1), 0
    world = [str(i // 5) for i in range(60)]
    for _ in range(400):
        effect = np.repeat(rng.normal(0, 2, 12), 5)
        found = paired_mean(rng.normal(0, 1, 60), rng.normal(1, 1, 60) + effect, world)
        inside += found["lo"] <= 1 <= found["hi"]
    assert 0.92 <= inside / 400 <= 0.98


@pytest.mark.parametrize(("only_a", "only_b"), [(0, 0), (0, 5), (3, 3), (1, 9), (20, 4)])
def test_mcnemar_is_the_exact_binomial_test(only_a: int, only_b: int) -> None:
    """Twice the smaller tail of a fair coin, at most 1."""
    n = only_a + only_b
    tail = sum(math.comb(n, k) for k in range(min(only_a, only_b) + 1)) / 2**n
    assert mcnemar(only_a, only_b) == pytest.approx(min(1.0, 2 * tail))


def test_a_rate_counts_the_pairs_that_turned() -> None:
    a = [True, True, True, False, False, True]
    b = [True, False, True, True, True, True]
    found = paired_rate(a, b, list("uvwxyz"))
    assert (found["only_a"], found["only_b"], found["mcnemar_p"]) == (1, 2, 1.0)
    assert (found["a"], found["b"]) == pytest.approx((4 / 6, 5 / 6))
