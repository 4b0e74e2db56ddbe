"""Plot of the matrix of `bench faults`: class by skill, each cell a bar coloured by verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from glotouch_bt.validation.faults.summary import matrix
from glotouch_bt.validation.faults.trial import VERDICTS

COLOURS = ("#16937a", "#8fb4e8", "#e08a1e", "#c42b3a")  # in the order of VERDICTS
EMPTY = "#eef0f3"


def plot_matrix(path: Path, rows: Sequence[Mapping[str, Any]], classes: Sequence[str], skills: Sequence[str]) -> None:
    """Draw each cell as a bar of its trials; grey: the class cannot affect that skill."""
    counts = matrix(rows, classes, skills)
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch, Rectangle

    figure = Figure(figsize=(1.9 + 1.05 * len(skills), 1.6 + 0.27 * len(classes)), layout="constrained")
    axes = figure.subplots()
    for y, name in enumerate(classes):
        for x, skill in enumerate(skills):
            cell = counts.get(name, {}).get(skill)
            axes.add_patch(Rectangle((x + 0.04, y + 0.12), 0.92, 0.76, facecolor=EMPTY))
            if cell is None:
                continue
            left = x + 0.04
            for n, colour in zip(cell, COLOURS, strict=True):
                width = 0.92 * n / sum(cell)
                axes.add_patch(Rectangle((left, y + 0.12), width, 0.76, facecolor=colour))
                left += width
    axes.set(xlim=(0, len(skills)), ylim=(len(classes), 0))
    axes.set_xticks([i + 0.5 for i in range(len(skills))], skills, rotation=25, ha="right", fontsize=8)
    axes.set_yticks([i + 0.5 for i in range(len(classes))], classes, fontsize=8)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    handles = [Patch(facecolor=c, label=v) for c, v in zip(COLOURS, VERDICTS, strict=True)]
    handles.append(Patch(facecolor=EMPTY, label="not tried"))
    figure.legend(handles=handles, loc="outside upper center", ncols=5, fontsize=8, frameon=False)
    figure.savefig(path, dpi=120)
