"""Summary of `bench match` from its rows, with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from glotouch_bt.bench.match.methods import DEFAULT, PAPER_TOP1
from glotouch_bt.bench.scores import shared_auroc, shared_calibration, shared_rate
from glotouch_bt.bench.search import quantiles
from glotouch_bt.bench.statistics import bootstrap_mean

Row = Mapping[str, Any]


def summarise(
    trials: Sequence[Row], pairs: Sequence[Row], closures: Sequence[Row], names: Sequence[str]
) -> dict[str, Any]:
    """Return the summary of the rows of `trials.py` and `closures.py`.

    Top-level `ece`, `auroc`, `absent_lifted` belong to the default method, or to the last one compared.
    """
    head = DEFAULT if DEFAULT in names else names[-1]
    per = {
        name: of_method([t for t in trials if t["method"] == name], [p for p in pairs if p["method"] == name])
        for name in names
    }
    matrices = {name: loss_matrix([p for p in pairs if p["method"] == name and not p["stranger"]]) for name in names}
    return {
        "methods": per,
        "paper": {name: {"row_top1": rate} for name, rate in PAPER_TOP1.items()},
        "loss_matrix": {"objects": object_names(pairs)} | matrices,
        "head": head,
        "ece": per[head]["ece"],
        "auroc": per[head]["auroc"],
        "absent_lifted": per[head]["absent_lifted"],
        "closures_to_confidence": {
            order: confidence([c for c in closures if c["order"] == order and c["present"]])
            | {"absent_taken": taken([c for c in closures if c["order"] == order and not c["present"]])}
            for order in dict.fromkeys(c["order"] for c in closures)
        },
    }


def of_method(trials: Sequence[Row], pairs: Sequence[Row]) -> dict[str, Any]:
    """Return one method's figures; objects that were never squeezed are counted separately."""
    present, absent, untouched, stranger = (
        [t for t in trials if t["kind"] == kind] for kind in ("present", "absent", "untouched", "stranger")
    )
    own = [p for p in pairs if not p["stranger"]]
    columns = column_decisions(own)
    fitted = [t for t in present if math.isfinite(t["position_error_mm"])]
    return {
        "row_top1": _share(present, [t["right"] for t in present]),
        "row_top1_untouched_wrong": _share(present + untouched, [bool(t["right"]) for t in present + untouched]),
        "row_by_target": {
            name: _share(mine, [t["right"] for t in mine])
            for name in sorted({t["target"] for t in present})
            if (mine := [t for t in present if t["target"] == name])
        },
        "col_top1": _share(columns, [c["right"] for c in columns]),
        **accepted(present, absent),
        "stranger_lifted": _share(stranger, [t["accepted"] for t in stranger]),
        "apart": {
            name: accepted([t for t in present if t["twin"] is twin], [t for t in absent if t["twin"] is twin])
            for name, twin in (("no_twin", False), ("twin", True))
        },
        "margin": bootstrap_mean([t["margin"] for t in present if math.isfinite(t["margin"])]),
        "auroc": separation(present, stranger) if stranger else separation(present, absent),
        "auroc_against": "strangers" if stranger else "absent",
        "auroc_absent": separation(present, absent),
        "ece": calibration(present + absent),
        "position_error_mm": quantiles([t["position_error_mm"] for t in fitted]),
        "yaw_error_deg": quantiles([t["yaw_error_deg"] for t in fitted]),
        "ms_per_pair": float(np.median([t["ms_per_pair"] for t in trials])) if trials else math.nan,
    }


def accepted(present: Sequence[Row], absent: Sequence[Row]) -> dict[str, Any]:
    """Return what was accepted for targets that are in the box, and for those that are not."""
    return {
        "right_and_accepted": _share(present, [t["right"] and t["accepted"] for t in present]),
        "wrong_and_accepted": _share(present, [t["accepted"] and not t["right"] for t in present]),
        "absent_lifted": _share(absent, [t["accepted"] for t in absent]),
    }


def _share(trials: Sequence[Row], right: Sequence[bool]) -> dict[str, Any]:
    return shared_rate(right, [t["seed"] for t in trials])


def column_decisions(pairs: Sequence[Row]) -> list[dict[str, Any]]:
    """Name each TouchSet by the STL of lowest loss; an infinite loss is wrong."""
    groups: dict[tuple[int, int], list[Row]] = {}
    for p in pairs:
        if p["object"] is not None:
            groups.setdefault((p["seed"], p["candidate"]), []).append(p)
    out = []
    for (seed, candidate), mine in sorted(groups.items()):
        best = min(mine, key=lambda p: (p["loss"], p["target"]))
        right = math.isfinite(best["loss"]) and best["target"] == best["object"]
        out.append({"seed": seed, "candidate": candidate, "object": best["object"], "right": right})
    return out


def object_names(pairs: Sequence[Row]) -> list[str]:
    """Return the sorted STL names of all boxes."""
    return sorted({p["target"] for p in pairs if not p["stranger"]})


def loss_matrix(pairs: Sequence[Row]) -> list[list[float]]:
    """Return the mean finite loss of each STL (row) against each object's TouchSets (column); NaN if there is none."""
    names = object_names(pairs)
    return [[_mean(p["loss"] for p in pairs if p["target"] == t and p["object"] == o) for o in names] for t in names]


def _mean(values: Any) -> float:
    finite = [v for v in values if math.isfinite(v)]
    return float(np.mean(finite)) if finite else math.nan


def separation(present: Sequence[Row], other: Sequence[Row]) -> dict[str, Any]:
    """Return the AUROC of present against absent targets, by 1 - p_absent and by the best loss."""
    out: dict[str, Any] = {"n_present": len(present), "n_not": len(other)}
    layouts = [t["seed"] for t in present], [t["seed"] for t in other]
    there, gone = ([1 - t["p_absent"] for t in rows] for rows in (present, other))
    fit, misfit = ([-t["best_loss"] for t in rows] for rows in (present, other))
    out["probability"], out["loss"] = shared_auroc(there, gone, layouts), shared_auroc(fit, misfit, layouts)
    return out


def calibration(trials: Sequence[Row]) -> dict[str, Any]:
    """Return ECE and reliability of the most probable answer (a candidate or none) over present and absent targets."""
    confidence = [max(t["p_best"], t["p_absent"]) for t in trials]
    return shared_calibration(confidence, [_answer_is_right(t) for t in trials], [t["seed"] for t in trials])


def _answer_is_right(trial: Row) -> bool:
    says_absent = trial["p_absent"] >= trial["p_best"]
    return bool(trial["right"] and not says_absent if trial["kind"] == "present" else says_absent)


def taken(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the rate of accepting something for an absent target."""
    return _share(rows, [r["confident"] for r in rows])


def confidence(rows: Sequence[Row]) -> dict[str, Any]:
    """Return closures to confidence, and the rates of confident and correct decisions."""
    sure = [r["confident"] for r in rows]
    return {
        "closures": bootstrap_mean([r["closures"] for r in rows]),
        "share_of_recorded": bootstrap_mean([r["closures"] / max(r["recorded"], 1) for r in rows]),
        "recorded": bootstrap_mean([r["recorded"] for r in rows]),
        "median": float(np.median([r["closures"] for r in rows])) if rows else math.nan,
        "confident": _share(rows, sure),
        "right": _share(rows, [r["right"] for r in rows]),
        "confident_and_wrong": _share(rows, [r["confident"] and not r["right"] for r in rows]),
    }
