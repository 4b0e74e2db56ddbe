"""Plots of `bench contact`: traces against the truth, and errors beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.bench.contact.square import TOOLS, rectangle, traced_square, true_square
from glotouch_bt.report import read_run
from glotouch_bt.robot import Array

SHOWN = 4
COLOURS = {"probe": "#2567c9", "gripper": "#e08a1e"}
LABELS = {
    "centre_error_mm": "centre",
    "contact_std_mm": "contact std",
    "contact_rms_mm": "contact RMS",
    "max_contact_mm": "max contact",
    "side_error_mm": "side",
}


def plot_errors(rows: Sequence[Mapping[str, Any]], paper: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Draw a box plot of each error, bolted and free, with the paper's mean as a mark."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.4), layout="constrained")
    for column, square in enumerate(("fixed", "free")):
        axes = figure.add_subplot(1, 2, column + 1)
        for k, (tool, colour) in enumerate(COLOURS.items()):
            values = [
                [r[m] for r in rows if (r["square"], r["tool"]) == (square, tool) and r.get(m) is not None]
                for m in LABELS
            ]
            at = np.arange(len(LABELS)) + 0.36 * (k - 0.5)
            boxes = axes.boxplot(values, positions=at, widths=0.3, patch_artist=True, manage_ticks=False)
            for box in boxes["boxes"]:
                box.set(facecolor=colour, alpha=0.45)
            for line in boxes["medians"]:
                line.set(color="black")
            marks = [paper[tool][m] for m in LABELS]
            axes.plot(at, marks, "D", color=colour, markeredgecolor="black", markersize=6, label=f"{tool}, paper")
            axes.plot([], [], "s", color=colour, alpha=0.45, label=f"{tool}, here")
        axes.set_yscale("log")
        axes.set_xticks(range(len(LABELS)), list(LABELS.values()))
        axes.set_ylabel("error, mm")
        axes.set_title("square bolted to the floor" if square == "fixed" else "square free")
        axes.grid(axis="y", which="both", alpha=0.25)
        axes.legend(fontsize=8, ncols=2)
    figure.savefig(path, dpi=130)


def plot_traces(rows: Sequence[Mapping[str, Any]], out: Path) -> None:
    """Write traces.png: a grid of traced squares with truth, contacts and fit, centred on the truth, in mm."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.1 * SHOWN, 3.2 * len(TOOLS)), layout="constrained")
    for line, tool in enumerate(TOOLS):
        good = [r for r in rows if (r["square"], r["tool"]) == ("fixed", tool) and not r["cause"]][:SHOWN]
        for column, row in enumerate(good):
            axes = figure.add_subplot(len(TOOLS), SHOWN, line * SHOWN + column + 1)
            record = read_run(out / row["folder"])
            traced = traced_square(record, tool, True)
            true = true_square(record, traced.height_B_m)
            origin, fitted = true.centre_B_m, rectangle(traced.centre_B_m, traced.side_m, traced.yaw_rad)
            axes.plot(*_closed(1e3 * (true.corners_B_m - origin)).T, color="#16834a", lw=2.5, label="truth")
            axes.plot(*_closed(1e3 * (fitted - origin)).T, "--", color="#d2452c", lw=1.2, label="fit")
            axes.plot(*(1e3 * (traced.points_B_m - origin)).T, ".", color=COLOURS[tool], ms=6, label="contacts")
            axes.plot(*(1e3 * (traced.centre_B_m - origin)), "x", color="#d2452c")
            axes.set_title(f"{tool}, seed {row['seed']}: centre {row['centre_error_mm']:.2f} mm", fontsize=9)
            axes.set_aspect("equal")
            axes.set(xlim=(-52, 52), ylim=(-52, 52))
            axes.tick_params(labelsize=7)
            if column == 0:
                axes.legend(fontsize=7, loc="upper left")
    figure.savefig(out / "traces.png", dpi=130)


def _closed(points: Array) -> Array:
    return np.vstack([points, points[:1]])
