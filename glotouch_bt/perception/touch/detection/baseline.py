"""Robust baseline of the wrist's wrench over a stationary, contact-free interval (paper III-A)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, ParamError, frozen_array

MAD_TO_SD = 1.4826
"""Standard deviation of a normal variable over its median absolute deviation (Huber, Robust Statistics, 1.2)."""


@dataclass(frozen=True)
class Baseline:
    """Contact-free wrench.

    Attributes:
        median: (6,) force N then torque Nm in S.
        sd: (6,) robust standard deviation of ONE sample, same units.
        n: Number of samples.
    """

    median: Array
    sd: Array
    n: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "median", frozen_array("baseline.median", self.median, (6,)))
        sd = frozen_array("baseline.sd", self.sd, (6,))
        if (sd < 0).any():
            raise ParamError("baseline.sd", sd.tolist(), "not negative")
        object.__setattr__(self, "sd", sd)

    @property
    def median_variance(self) -> float:
        """Variance of the median over that of one sample: pi / (2 n) for normal noise."""
        return math.pi / (2 * self.n)


def fit_baseline(wrench_S: Array) -> Baseline:
    """Compute median and MAD-based deviation of a stationary interval, wrench_S (n, 6) in N and Nm.

    Raises:
        ParamError: Not (n, 6), fewer than 3 samples, or a value that is not finite.
    """
    w = np.asarray(wrench_S, dtype=np.float64)
    if w.ndim != 2 or w.shape[1] != 6 or len(w) < 3:
        raise ParamError("wrench_S", w.shape, "an (n, 6) array with n >= 3")
    if not np.isfinite(w).all():
        raise ParamError("wrench_S", "NaN or infinity inside", "finite")
    median = np.median(w, axis=0)
    return Baseline(median, MAD_TO_SD * np.median(np.abs(w - median), axis=0), len(w))
