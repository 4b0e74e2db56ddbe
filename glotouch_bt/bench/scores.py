"""Calibration, separation and rates of decisions whose trials share a layout. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from glotouch_bt.bench.statistics import wilson
from glotouch_bt.robot import Array

BINS = 10
RESAMPLES = 1000


def reliability(confidence: npt.ArrayLike, right: npt.ArrayLike, bins: int = BINS) -> list[dict[str, float]]:
    """Return mean confidence, share correct and count of each non-empty bin of equal width over [0, 1].

    Bins are (lo, hi]; 0 belongs to the first (Guo et al., ICML 2017).
    """
    p, hit = np.asarray(confidence, dtype=np.float64), np.asarray(right, dtype=np.float64)
    at = bin_of(p, bins)
    out = []
    for b in range(bins):
        mine = at == b
        if mine.any():
            out.append(
                {"lo": b / bins, "hi": (b + 1) / bins, "confidence": float(p[mine].mean()),
                 "right": float(hit[mine].mean()), "n": float(mine.sum())}
            )  # fmt: skip
    return out


def bin_of(confidence: Array, bins: int) -> npt.NDArray[np.int64]:
    """Return the bin of each confidence."""
    return np.clip(np.ceil(confidence * bins).astype(np.int64) - 1, 0, bins - 1)


def calibration_error(confidence: npt.ArrayLike, right: npt.ArrayLike, bins: int = BINS) -> float:
    """Return the expected calibration error: mean |share correct - mean confidence| over trials; NaN if empty."""
    found = reliability(confidence, right, bins)
    n = sum(b["n"] for b in found)
    return sum(b["n"] * abs(b["right"] - b["confidence"]) for b in found) / n if n else float("nan")


def auroc(positive: npt.ArrayLike, negative: npt.ArrayLike) -> float:
    """Return P(a positive scores above a negative), ties half (Mann-Whitney); NaN if one side is empty.

    Scores may be infinite; NaN scores count as lowest.
    """
    a, b = _scores(positive), _scores(negative)
    if not a.size or not b.size:
        return float("nan")
    _, place, ties = np.unique(np.concatenate([a, b]), return_inverse=True, return_counts=True)
    rank = (np.cumsum(ties) - 0.5 * (ties - 1))[place]  # equal scores share their mean rank
    return float((rank[: a.size].sum() - a.size * (a.size + 1) / 2) / (a.size * b.size))


def _scores(values: npt.ArrayLike) -> Array:
    return np.nan_to_num(np.asarray(values, dtype=np.float64), nan=-np.inf, posinf=np.inf, neginf=-np.inf)


def shared_rate(right: Sequence[bool], layout: npt.ArrayLike) -> dict[str, Any]:
    """Return a rate of trials grouped by layout, with intervals that do and do not assume independence.

    Returns:
        `rate`, `lo`, `hi`, `n` (Wilson 95 %), `by_layout` (percentile bootstrap over layouts; zero width if all trials
        agree) and `whole_layouts` (Wilson interval of layouts with every trial correct).
    """
    hit = np.asarray(right, dtype=np.float64)
    draws = Draws.of(layout)
    good, count = draws.sums(hit), draws.sums(np.ones(len(hit)))
    out: dict[str, Any] = dict(wilson(int(hit.sum()), len(hit)))
    out["by_layout"] = draws.interval(draws.weight @ good, draws.weight @ count)
    out["whole_layouts"] = wilson(int((good == count).sum()), len(count))
    return out


def shared_auroc(
    positive: npt.ArrayLike, negative: npt.ArrayLike, layouts: tuple[npt.ArrayLike, npt.ArrayLike]
) -> dict[str, Any]:
    """Return `auroc` as `value` with its interval over layouts; `layouts` are those of the positives and negatives.

    Ordered pairs are counted once for every two layouts; each bootstrap draw weights the counts.
    """
    a, b = _scores(positive), _scores(negative)
    of_a, of_b = (np.asarray(x) for x in layouts)
    draws = Draws.of(np.concatenate([of_a, of_b]))
    in_order = (a[:, None] > b[None]) + 0.5 * (a[:, None] == b[None])  # (a, b)
    is_a = (of_a[None] == draws.names[:, None]).astype(np.float64)  # (layouts, a)
    is_b = (of_b[None] == draws.names[:, None]).astype(np.float64)
    won, pairs = is_a @ in_order @ is_b.T, is_a.sum(axis=1)[:, None] * is_b.sum(axis=1)[None]
    over, under = (np.einsum("ri,ij,rj->r", draws.weight, m, draws.weight) for m in (won, pairs))
    return {"value": auroc(a, b), **draws.interval(over, under)}


def shared_calibration(confidence: npt.ArrayLike, right: npt.ArrayLike, layout: npt.ArrayLike) -> dict[str, Any]:
    """Return `calibration_error` as `value` with its interval over layouts, and the bins of `reliability`."""
    p, hit = np.asarray(confidence, dtype=np.float64), np.asarray(right, dtype=np.float64)
    draws = Draws.of(layout)
    binned = (bin_of(p, BINS)[None] == np.arange(BINS)[:, None]) * (hit - p)[None]  # (bins, trials)
    off = np.stack([draws.weight @ draws.sums(b) for b in binned]) if len(p) else np.zeros((BINS, 0))
    count = draws.weight @ draws.sums(np.ones(len(p)))
    value = {"value": calibration_error(p, hit), **draws.interval(np.abs(off).sum(axis=0), count)}
    return value | {"n": len(p), "bins": reliability(p, hit)}


@dataclass(frozen=True, eq=False)
class Draws:
    """Layouts drawn with replacement: percentile bootstrap over layouts (B. Efron, 1979). Seeded.

    Attributes:
        names: (l,) layouts.
        member: (l, n) 1 where a trial belongs to a layout.
        weight: (draws, l) number of times each was drawn.
    """

    names: npt.NDArray[Any]
    member: Array
    weight: Array

    @classmethod
    def of(cls, layout: npt.ArrayLike, resamples: int = RESAMPLES, seed: int = 0) -> Draws:
        """Draw for trials whose layouts are `layout` (n,)."""
        groups = np.asarray(layout)
        names = np.unique(groups)
        count = len(names)
        share = np.full(count, 1 / max(count, 1))
        weight = np.random.default_rng(seed).multinomial(count, share, resamples) if count else np.zeros((resamples, 0))
        return cls(names, (groups[None] == names[:, None]).astype(np.float64), weight.astype(np.float64))

    def sums(self, values: Array) -> Array:
        """Return the sum (l,) of the trials' values in each layout."""
        return np.asarray(self.member @ values)

    def interval(self, over: Array, under: Array) -> dict[str, Any]:
        """Return the 95 % interval of over / under (draws,); draws of 0 / 0 are left out."""
        use = under > 0
        lo, hi = np.percentile(over[use] / under[use], [2.5, 97.5]) if use.any() else (np.nan, np.nan)
        return {"lo": float(lo), "hi": float(hi), "layouts": len(self.names)}
