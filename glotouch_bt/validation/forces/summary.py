"""Summary of `bench forces`: rates of the three offences, largest peaks, wall times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from glotouch_bt.bench import wilson
from glotouch_bt.robot import Limits
from glotouch_bt.validation.forces.trial import FALSE, NO_RESULT, NOT_STARTED, OVER, REFUSED, offences

LISTED = 10
"""Number of largest peaks that the summary lists."""

Rows = Sequence[Mapping[str, Any]]


def summarise(rows: Rows) -> dict[str, Any]:
    """Return rates with Wilson intervals over the trials in which a fault altered something; forces in N, times in s.

    Trials whose faults altered nothing, whose plan was refused, or whose robot failed before the first tick are listed
    apart.
    """
    tried = [r for r in rows if r["effective"]]
    cells = [r for r in tried if "moment" in r]
    found = Counter(what for r in tried for what in offences(r))
    known = sorted((r for r in rows if _peak(r) is not None), key=lambda r: -(_peak(r) or 0.0))
    return {
        "trials": len(tried),
        "several_effective": sum(r["effective"] > 1 for r in tried),
        "without_effect": [
            r["folder"] for r in rows if not r["effective"] and r["status"] not in (REFUSED, NOT_STARTED)
        ],
        "refused": [f"{r['folder']}: {r['cause']}" for r in rows if r["status"] == REFUSED],
        "not_started": [f"{r['folder']}: {r['cause']}" for r in rows if r["status"] == NOT_STARTED],
        "over_hard_limit": wilson(found[OVER], len(tried)),
        "false_success": wilson(found[FALSE], len(tried)),
        "no_result": wilson(found[NO_RESULT], len(tried)),
        "true_peak_unknown": [r["folder"] for r in tried if _peak(r) is None],
        "ends": dict(Counter(str(r["status"]) for r in tried).most_common()),
        "hard_force_N": Limits().hard_force_N,
        "largest_peak_force_N": _largest(known),
        "largest_peaks": [
            {k: r.get(k) for k in ("folder", "mission", "backend", "peak_force_N", "felt_peak_N", "faults", "cause")}
            for r in known[:LISTED]
        ],
        "by_scene": _grouped(tried, lambda r: f"{r['mission']} on {r['backend']}"),
        "by_fault": _grouped_by_fault(tried),
        "by_moment": _grouped(cells, lambda r: f"{r['moment']} on {r['backend']}"),
        "by_joint": _grouped(cells, lambda r: f"joint {r['joint']}"),
        "by_rate": _grouped(cells, lambda r: f"{abs(r['rate_rad_s']):.2f} rad/s"),
    }


def _peak(row: Mapping[str, Any]) -> float | None:
    peak = row.get("peak_force_N")
    return None if peak is None else float(peak)


def _largest(rows: Rows) -> float | None:
    return max((p for r in rows if (p := _peak(r)) is not None), default=None)


def _grouped(rows: Rows, key: Callable[[Mapping[str, Any]], str]) -> dict[str, dict[str, Any]]:
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return {name: _group(groups[name]) for name in sorted(groups)}


def _grouped_by_fault(rows: Rows) -> dict[str, dict[str, Any]]:
    """Group by each fault that altered something; a trial of several counts in each."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        for fault in str(row["faults"]).split("; "):
            name = fault.split("(", 1)[0]
            if name not in row.get("without_effect", ()):
                groups.setdefault(name, []).append(row)
    return {name: _group(groups[name]) for name in sorted(groups)}


def _group(rows: Rows) -> dict[str, Any]:
    counts = Counter(what for r in rows for what in offences(r))
    return {
        "trials": len(rows),
        "offending": sum(bool(offences(r)) for r in rows),
        "over": counts[OVER],
        "false_success": counts[FALSE],
        "no_result": counts[NO_RESULT],
        "largest_peak_force_N": _largest(rows),
        "mean_wall_s": round(sum(float(r["wall_s"]) for r in rows) / len(rows), 2),
    }
