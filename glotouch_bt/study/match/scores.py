"""How good probabilities and scores are: calibration, separation, and rates whose trials share a layout. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import rankdata

from glotouch_bt.robot import Array
from glotouch_bt.study.statistics import wilson

BINS = 10
RESAMPLES = 1000
Statistic = Callable[[npt.NDArray[np.int64]], float]


def reliability(confidence: npt.ArrayLike, right: npt.ArrayLike, bins: int = BINS) -> list[dict[str, float]]:
    """Mean confidence, share right and count of each bin of equal width over [0, 1] that holds anything.

    A confidence on an edge counts with the bin below it, as in (lo, hi]; 0 with the first (Guo et al., ICML 2017).
    """
    p, hit = np.asarray(confidence, dtype=np.float64), np.asarray(right, dtype=np.float64)
    at = np.clip(np.ceil(p * bins).astype(np.int64) - 1, 0, bins - 1)
    out = []
    for b in range(bins):
        mine = at == b
        if mine.any():
            out.append(
                {"lo": b / bins, "hi": (b + 1) / bins, "confidence": float(p[mine].mean()),
                 "right": float(hit[mine].mean()), "n": float(mine.sum())}
            )  # fmt: skip
    return out


def calibration_error(confidence: npt.ArrayLike, right: npt.ArrayLike, bins: int = BINS) -> float:
    """Expected calibration error: |share right - mean confidence| of a trial's bin, mean over trials; NaN of none."""
    found = reliability(confidence, right, bins)
    n = sum(b["n"] for b in found)
    return sum(b["n"] * abs(b["right"] - b["confidence"]) for b in found) / n if n else float("nan")


def auroc(positive: npt.ArrayLike, negative: npt.ArrayLike) -> float:
    """Probability that a positive scores above a negative, ties half (Mann-Whitney); NaN if one side is empty.

    Scores may be infinite; NaN scores count as lowest.
    """
    a, b = np.asarray(positive, dtype=np.float64).ravel(), np.asarray(negative, dtype=np.float64).ravel()
    if not a.size or not b.size:
        return float("nan")
    rank = rankdata(np.nan_to_num(np.concatenate([a, b]), nan=-np.inf, posinf=np.inf, neginf=-np.inf))
    return float((rank[: a.size].sum() - a.size * (a.size + 1) / 2) / (a.size * b.size))


def shared_rate(right: Sequence[bool], layout: Sequence[int]) -> dict[str, Any]:
    """A rate of trials that come in layouts: Wilson as if all were independent, and what does not need that.

    Returns:
        `rate`, `lo`, `hi`, `n` (Wilson 95 %), `by_layout` (percentile bootstrap over whole layouts; of no width if all
        trials agree, so read it with the next) and `whole_layouts` (Wilson of layouts with every trial right).
    """
    hit = np.asarray(right, dtype=np.float64)
    groups = np.asarray(layout)
    names = np.unique(groups)
    out: dict[str, Any] = dict(wilson(int(hit.sum()), len(hit)))
    out["by_layout"] = by_layout(lambda pick: float(hit[pick].mean()), groups)
    out["whole_layouts"] = wilson(sum(bool(hit[groups == g].all()) for g in names), len(names))
    return out


def by_layout(
    statistic: Statistic, layout: Sequence[int] | npt.NDArray[Any], resamples: int = RESAMPLES, seed: int = 0
) -> dict[str, Any]:
    """Percentile 95 % interval of a statistic of trials when whole layouts are drawn with replacement.

    Args:
        statistic: Of trials given by their places; not called without any. NaN draws are left out.
        layout: The layout of each trial.
        resamples: Draws.
        seed: Of the draws.
    """
    groups = np.asarray(layout)
    names = np.unique(groups)
    if not len(names):
        return {"lo": float("nan"), "hi": float("nan"), "layouts": 0}
    places = [np.flatnonzero(groups == g) for g in names]
    drawn = np.random.default_rng(seed).integers(0, len(names), (resamples, len(names)))
    values: Array = np.array([statistic(np.concatenate([places[i] for i in row])) for row in drawn])
    values = values[np.isfinite(values)]
    lo, hi = np.percentile(values, [2.5, 97.5]) if values.size else (np.nan, np.nan)
    return {"lo": float(lo), "hi": float(hi), "layouts": len(names)}
