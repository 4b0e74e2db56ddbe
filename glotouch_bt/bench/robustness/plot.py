"""Picture of `bench robustness`: one small panel an axis, from which a lab reads how good its equipment must be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.bench.robustness.axes import AXES

COLUMNS = 4
DECISION_RATES = {"accepted": "right and accepted", "wrong": "wrong accepted", "absent_taken": "absent taken"}
MISSION_RATES = {"success": "retrieved", "wrong_object": "wrong object", "safety_stops": "safety stops"}
WANTED = 0.9
"""Acceptance drawn as a line: an axis at this level counts as tolerated. Source: ours."""


def rates_of(summary: Mapping[str, Any]) -> Mapping[str, str]:
    """Return the rates of a sweep, of missions or of decisions, and their labels; the right one comes first."""
    return MISSION_RATES if "success" in summary["axes"]["none"][0] else DECISION_RATES


def plot_axes(path: Path, summary: Mapping[str, Any]) -> None:
    """Draw the right share against each axis, with 95 % bands, and the wrong share: of decisions, or of missions."""
    names = [n for n in summary["axes"] if n in AXES]
    if not names:
        return
    rates = rates_of(summary)
    columns = min(COLUMNS, len(names))
    rows = math.ceil(len(names) / columns)
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.1 * columns, 2.3 * rows + 0.3), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for name, axes in zip(names, panels, strict=False):
        points, axis = summary["axes"][name], AXES[name]
        x = [p["level"] * axis.shown for p in points]
        right, wrong = ([p[key] for p in points] for key in list(rates)[:2])
        axes.fill_between(x, [r["lo"] for r in right], [r["hi"] for r in right], color="#2567c9", alpha=0.15, lw=0)
        for found, style, colour, label in zip(
            (right, wrong), ("o-", "s-"), ("#2567c9", "#c4433f"), rates.values(), strict=False
        ):
            axes.plot(x, [r.get("mean", r.get("rate")) for r in found], style, ms=4, color=colour, label=label)
        axes.axhline(WANTED, color="#6b7787", lw=0.8, ls=":")
        axes.set_xlabel(axis.label)
        axes.set_ylim(-0.03, 1.03)
        axes.grid(alpha=0.3)
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    panels[0].legend(fontsize=7, loc="lower left")
    n = len(summary["seeds"])
    figure.suptitle(
        f"{summary['mission']} with one axis varied, {summary['conditions']} otherwise, {n} boxes a point", fontsize=10
    )
    figure.savefig(path, dpi=110)
