"""Summary of `bench faults`: matrix of verdicts and rates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from glotouch_bt.bench import bootstrap_mean, wilson
from glotouch_bt.faults import CATALOGUE
from glotouch_bt.robot import Limits
from glotouch_bt.validation.faults.trial import VERDICTS

Row = Mapping[str, Any]


def summarise(rows: Sequence[Row]) -> dict[str, Any]:
    """Return rates with Wilson intervals over the trials whose fault altered something.

    recovered: over recoverable faults on seeds whose twin succeeds. named: over trials that did not reach the goal.
    Faults that altered nothing are listed and excluded from all rates.
    """
    twins = [r for r in rows if r["class"] == "none"]
    faulted = [r for r in rows if r["class"] != "none"]
    tried = [r for r in faulted if r["effective"]]
    counts = Counter(r["verdict"] for r in tried)
    can = [r for r in tried if CATALOGUE[r["class"]].recoverable and r.get("twin_ok")]
    ended = [r for r in tried if r["status"] != "success"]
    wrong_object = [r for r in tried if r.get("retrieved") and not r.get("correct")]
    peaks = [float(r["peak_force_N"]) for r in rows if r.get("peak_force_N") is not None]
    latencies = [float(r["latency_s"]) for r in tried if r.get("latency_s") is not None]
    return {
        "trials": len(tried),
        "twins": len(twins),
        "twins_succeeded": sum(r["verdict"] == "recovered" for r in twins),
        "altered_nothing": [f"{r['class']} in {r['skill']}, seed {r['seed']}" for r in faulted if not r["effective"]],
        "verdicts": {v: counts.get(v, 0) for v in VERDICTS},
        "hard_limit_broken": sum(float(r.get("peak_force_N") or 0.0) > Limits().hard_force_N for r in tried),
        "tracebacks": sum(r["status"] == "traceback" for r in tried),
        "hangs": sum(r["status"] == "hang" for r in tried),
        "lost": sum(r["status"] == "lost" for r in tried),
        "wrong_object": wilson(len(wrong_object), len(tried)),
        "named": wilson(sum(bool(r.get("named")) for r in ended), len(ended)),
        "recovered": wilson(sum(r["verdict"] == "recovered" for r in can), len(can)),
        "largest_peak_force_N": max(peaks, default=0.0),
        "latency_s": bootstrap_mean(latencies),
        "wall_s": bootstrap_mean([float(r["wall_s"]) for r in rows]),
        "by_class": {
            name: {v: sum(r["class"] == name and r["verdict"] == v for r in tried) for v in VERDICTS}
            | {"named": sum(r["class"] == name and bool(r.get("named")) for r in ended)}
            | {"ended": sum(r["class"] == name for r in ended)}
            for name in dict.fromkeys(r["class"] for r in tried)
        },
        "seen_by": dict(Counter(_who(r) for r in tried).most_common()),
        "causes": dict(Counter(str(r["cause"]) for r in ended).most_common()),
    }


def _who(row: Row) -> str:
    by = str(row.get("seen_by") or "nobody").rsplit("/", 1)[-1]
    return f"{by}: {row['seen_code']}" if row.get("seen_code") else by


def matrix(rows: Sequence[Row], classes: Sequence[str], skills: Sequence[str]) -> dict[str, dict[str, list[int]]]:
    """Return counts of each verdict (in the order of `VERDICTS`) by class and skill; empty cells are left out."""
    found: dict[str, dict[str, list[int]]] = {}
    for name in classes:
        for skill in skills:
            cell = [r for r in rows if r["class"] == name and r["skill"] == skill and r["effective"]]
            if cell:
                found.setdefault(name, {})[skill] = [sum(r["verdict"] == v for r in cell) for v in VERDICTS]
    return found
