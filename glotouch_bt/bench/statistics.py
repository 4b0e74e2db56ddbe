"""Rates and means with 95 % intervals."""

from __future__ import annotations

from typing import TypedDict

import numpy as np
import numpy.typing as npt


class Rate(TypedDict):
    """A rate with its Wilson 95 % interval over n trials."""

    rate: float
    lo: float
    hi: float
    n: int


class Mean(TypedDict):
    """A mean with its bootstrap 95 % interval over n values."""

    mean: float
    lo: float
    hi: float
    n: int


def wilson(successes: int, n: int) -> Rate:
    """Return a rate with the Wilson score interval at 95 % (E. B. Wilson, JASA 22, 1927). n = 0 gives the whole range.

    Raises:
        ValueError: Not 0 <= successes <= n.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n}: must be 0 <= successes <= n")
    if n == 0:
        return {"rate": float("nan"), "lo": 0.0, "hi": 1.0, "n": 0}
    z2 = 1.959963984540054**2
    p = successes / n
    centre = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = np.sqrt(z2 * (p * (1 - p) / n + z2 / (4 * n * n))) / (1 + z2 / n)
    lo = 0.0 if successes == 0 else float(centre - half)
    hi = 1.0 if successes == n else float(centre + half)
    return {"rate": p, "lo": lo, "hi": hi, "n": n}


def bootstrap_mean(values: npt.ArrayLike, resamples: int = 2000, seed: int = 0) -> Mean:
    """Return a mean with the percentile bootstrap interval at 95 % (B. Efron, Ann. Statist. 7, 1979); seeded."""
    x = np.asarray(values, dtype=np.float64)
    if x.size == 0:
        return {"mean": float("nan"), "lo": float("nan"), "hi": float("nan"), "n": 0}
    rng = np.random.default_rng(seed)
    means = x[rng.integers(0, x.size, (resamples, x.size))].mean(axis=1)
    lo, hi = np.percentile(means, [2.5, 97.5])
    return {"mean": float(x.mean()), "lo": float(lo), "hi": float(hi), "n": int(x.size)}
