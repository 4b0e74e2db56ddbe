"""Statistics of paired trials: the same layouts, seeds and targets in two campaigns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import numpy as np
import numpy.typing as npt
from scipy import stats

CONFIDENCE = 0.95


class PairedMean(TypedDict):
    """A mean difference with its interval over worlds; a, b, difference, lo and hi in the unit of the values."""

    a: float
    b: float
    difference: float
    lo: float
    hi: float
    p: float
    n: int
    worlds: int


class PairedRate(PairedMean):
    """A difference of rates with its interval over worlds, and McNemar's exact test over trials."""

    only_a: int
    only_b: int
    mcnemar_p: float


def paired_mean(a: npt.ArrayLike, b: npt.ArrayLike, world: Sequence[str]) -> PairedMean:
    """Return the mean of b - a with its 95 % interval over independent worlds.

    The differences of a world are averaged first; the worlds' means then give Student's t interval and the two-sided
    p-value of the paired t-test (Student, Biometrika 6, 1908). Fewer than two worlds have no interval (NaN).

    Args:
        a, b: (n,) values of the same trials in the two campaigns, n >= 1.
        world: (n,) world of each trial.
    """
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    _, member = np.unique(np.asarray(world), return_inverse=True)
    count = np.bincount(member)
    mean = np.bincount(member, y - x) / count
    difference, lo, hi, p = float(mean.mean()), np.nan, np.nan, np.nan
    if len(mean) > 1 and np.ptp(mean) > 0:
        test = stats.ttest_1samp(mean, 0.0)
        interval = test.confidence_interval(CONFIDENCE)
        lo, hi, p = float(interval.low), float(interval.high), float(test.pvalue)
    elif len(mean) > 1:  # all worlds agree: the t statistic is 0 / 0 or infinite
        lo, hi, p = difference, difference, float(difference == 0.0)
    return {
        "a": float((np.bincount(member, x) / count).mean()),
        "b": float((np.bincount(member, y) / count).mean()),
        "difference": difference,
        "lo": float(lo),
        "hi": float(hi),
        "p": float(p),
        "n": len(x),
        "worlds": len(mean),
    }


def paired_rate(a: npt.ArrayLike, b: npt.ArrayLike, world: Sequence[str]) -> PairedRate:
    """Return the difference of two rates over worlds, and McNemar's exact test over trials.

    Args:
        a, b: (n,) success of the same trials in the two campaigns, n >= 1.
        world: (n,) world of each trial.
    """
    x, y = np.asarray(a, dtype=bool), np.asarray(b, dtype=bool)
    only_a, only_b = int((x & ~y).sum()), int((y & ~x).sum())
    over_worlds = paired_mean(x, y, world)
    return {**over_worlds, "only_a": only_a, "only_b": only_b, "mcnemar_p": mcnemar(only_a, only_b)}


def mcnemar(only_a: int, only_b: int) -> float:
    """Return the two-sided exact p-value of McNemar's test: the pairs that differ fall either way with probability 1/2.

    Source: Q. McNemar, Psychometrika 12, 1947, with the binomial distribution. It takes trials as independent; trials
    that share a layout are not, and the interval over worlds is then the one to read.
    """
    differ = only_a + only_b
    return float(stats.binomtest(only_a, differ, 0.5).pvalue) if differ else 1.0
