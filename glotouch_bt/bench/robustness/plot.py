"""Picture of `bench robustness`: one small panel an axis, from which a lab reads how good its equipment must be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from glotouch_bt.bench.robustness.axes import AXES

COLUMNS = 4
WANTED = 0.9
"""Acceptance drawn as a line: an axis at this level counts as tolerated. Source: ours."""


def plot_axes(path: Path, summary: Mapping[str, Any]) -> None:
    """Draw the right and accepted share against each axis, with 95 % bands, and the wrongly accepted share."""
    names = [n for n in summary["axes"] if n in AXES]
    if not names:
        return
    columns = min(COLUMNS, len(names))
    rows = math.ceil(len(names) / columns)
    figure = Figure(figsize=(3.1 * columns, 2.3 * rows + 0.3), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for name, axes in zip(names, panels, strict=False):
        points, axis = summary["axes"][name], AXES[name]
        x = [p["level"] * axis.shown for p in points]
        accepted = [p["accepted"] for p in points]
        axes.fill_between(
            x, [a["lo"] for a in accepted], [a["hi"] for a in accepted], color="#2567c9", alpha=0.15, lw=0
        )
        axes.plot(x, [a["mean"] for a in accepted], "o-", ms=4, color="#2567c9", label="right and accepted")
        axes.plot(x, [p["wrong"]["mean"] for p in points], "s-", ms=3, color="#c4433f", label="wrong accepted")
        axes.axhline(WANTED, color="#6b7787", lw=0.8, ls=":")
        axes.set_xlabel(axis.label)
        axes.set_ylim(-0.03, 1.03)
        axes.grid(alpha=0.3)
    for axes in panels[len(names) :]:
        axes.set_visible(False)
    panels[0].legend(fontsize=7, loc="lower left")
    n = len(summary["seeds"])
    figure.suptitle(
        f"Recognition with one axis varied, {summary['conditions']} otherwise, {n} boxes a point", fontsize=10
    )
    figure.savefig(path, dpi=110)
