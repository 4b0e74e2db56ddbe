"""Summary of `bench search` from its rows, with intervals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from glotouch_bt.bench.search.scoring import discovered_at
from glotouch_bt.bench.statistics import bootstrap_mean, wilson

MEAN_AT_M = (1.0, 3.0, 5.0)
COMPLETE_AT_M = (3.0, 5.0, 6.0)
PAPER = {
    "random_descent": {"mean_discovered": {"1": 1.23, "3": 3.17, "5": 4.02}, "complete": {"5": 0.30}},
    "global_search": {"mean_discovered": {"1": 1.35, "3": 3.30, "5": 4.44}, "complete": {"5": 0.55}},
}
"""The paper's global-search ablation, on its own 100 layouts."""
ERRORS = ("centre_error_mm", "height_error_mm", "yaw_error_deg", "displaced_mm")

Row = Mapping[str, Any]


def summarise(rows: Sequence[Row], policies: Sequence[str], objects: int) -> dict[str, Any]:
    """Return the summary of the rows; results of the planar simulator go under `planar`.

    Args:
        rows: One row a trial, see `trial`.
        policies: In the order to report; candidate errors at the top level are the first policy's.
        objects: Number of objects in a layout.
    """
    real = [r for r in rows if r["simulator"] != "planar"]
    plane = [r for r in rows if r["simulator"] == "planar"]

    def by_policy(rows: Sequence[Row]) -> dict[str, Any]:
        groups = {name: [r for r in rows if r["policy"] == name] for name in policies}
        return {n: discovery(g, objects) | {"candidates": candidate_errors(g)} for n, g in groups.items() if g}

    out: dict[str, Any] = {"policies": by_policy(real), "paper": PAPER, "candidates": {}}
    if out["policies"]:
        out["candidates"] = next(iter(out["policies"].values()))["candidates"]
    if plane:
        out["planar"] = by_policy(plane)
    if real and plane:
        out["validation"] = {
            name: validation(
                [r for r in real if r["policy"] == name], [r for r in plane if r["policy"] == name], objects
            )
            for name in policies
        }
    return out


def discovery(rows: Sequence[Row], objects: int) -> dict[str, Any]:
    """Return mean discoveries and completion rate at each travel and in the end, and the share found in the end.

    An aborted trial counts up to its end.
    """
    n = len(rows)
    ends = [r["discovered_m"][objects - 1] for r in rows if len(r["discovered_m"]) >= objects]
    return {
        "mean_discovered": {f"{d:g}": bootstrap_mean([discovered_at(r, d) for r in rows]) for d in MEAN_AT_M},
        "complete": {f"{d:g}": wilson(sum(discovered_at(r, d) >= objects for r in rows), n) for d in COMPLETE_AT_M},
        "complete_in_the_end": wilson(sum(len(r["discovered_m"]) >= objects for r in rows), n),
        "found_share": bootstrap_mean([len(r["discovered_m"]) / objects for r in rows]),
        "travel_to_complete_m": quantiles(ends),
        "false_candidates": bootstrap_mean([r["false_candidates"] for r in rows]),
        "contacts": bootstrap_mean([r["contacts"] for r in rows]),
        "ended": dict(Counter(r["ended"] for r in rows).most_common()),
    }


def candidate_errors(rows: Sequence[Row]) -> dict[str, Any]:
    """Return median and 95th percentile of each error over all assigned candidates."""
    every = [c for r in rows for c in r["candidates"]]
    return {key: quantiles([c[key] for c in every if c[key] is not None]) for key in ERRORS}


def validation(real: Sequence[Row], plane: Sequence[Row], objects: int) -> dict[str, Any]:
    """Compare the planar simulator with MuJoCo on the layouts that both explored.

    `travel_to_complete` compares layouts that both completed. `discovered` is the paired difference, planar minus
    MuJoCo. `contact_gap_mm` is the distance of the ball from the true probe section where a MuJoCo sweep stopped.
    """
    by_seed = {r["seed"]: r for r in plane}
    pairs = [(r, by_seed[r["seed"]]) for r in real if r["seed"] in by_seed]
    both = [
        (a["discovered_m"][objects - 1], b["discovered_m"][objects - 1])
        for a, b in pairs
        if min(len(a["discovered_m"]), len(b["discovered_m"])) >= objects
    ]
    travel = np.array(both).reshape(-1, 2)
    gaps = np.array([g for r in real for g in r.get("contact_gap_mm", ())])
    return {
        "layouts": len(pairs),
        "both_complete": len(both),
        "travel_to_complete": {
            "correlation": correlation(travel[:, 0], travel[:, 1]),
            "mean_difference_m": bootstrap_mean(travel[:, 1] - travel[:, 0]),
        },
        "discovered": {
            f"{d:g}": bootstrap_mean([discovered_at(b, d) - discovered_at(a, d) for a, b in pairs]) for d in MEAN_AT_M
        },
        "contact_gap_mm": {"bias": bootstrap_mean(gaps), "absolute": quantiles(np.abs(gaps))},
    }


def correlation(a: npt.ArrayLike, b: npt.ArrayLike, resamples: int = 2000, seed: int = 0) -> dict[str, Any]:
    """Return Pearson's r with its bootstrap 95 % interval; NaN for fewer than 3 pairs or constant values."""
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    nothing = {"r": float("nan"), "lo": float("nan"), "hi": float("nan"), "n": len(x)}
    if len(x) < 3 or np.ptp(x) == 0 or np.ptp(y) == 0:
        return nothing
    pick = np.random.default_rng(seed).integers(0, len(x), (resamples, len(x)))
    u, v = x[pick] - x[pick].mean(axis=1, keepdims=True), y[pick] - y[pick].mean(axis=1, keepdims=True)
    scale = np.sqrt((u * u).sum(axis=1) * (v * v).sum(axis=1))
    r = (u * v).sum(axis=1)[scale > 0] / scale[scale > 0]
    lo, hi = np.percentile(r, [2.5, 97.5])
    return {"r": float(np.corrcoef(x, y)[0, 1]), "lo": float(lo), "hi": float(hi), "n": len(x)}


def quantiles(values: npt.ArrayLike, resamples: int = 1000, seed: int = 0) -> dict[str, Any]:
    """Return median and 95th percentile, each with its percentile bootstrap 95 % interval (B. Efron, 1979)."""
    x = np.asarray(values, dtype=np.float64)
    none = {"value": float("nan"), "lo": float("nan"), "hi": float("nan")}
    if x.size == 0:
        return {"median": none, "p95": none, "n": 0}
    drawn = x[np.random.default_rng(seed).integers(0, x.size, (resamples, x.size))]
    out: dict[str, Any] = {"n": int(x.size)}
    for key, q in (("median", 50.0), ("p95", 95.0)):
        lo, hi = np.percentile(np.percentile(drawn, q, axis=1), [2.5, 97.5])
        out[key] = {"value": float(np.percentile(x, q)), "lo": float(lo), "hi": float(hi)}
    return out
