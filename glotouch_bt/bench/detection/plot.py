"""Plot of the operating curve."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

COLOURS = {"sweep": "tab:blue", "step": "tab:green", "down": "tab:red"}


def plot_curves(summary: Mapping[str, Any], path: Path) -> None:
    """Write a PNG of the share of detected pushes against force, one panel a condition, with Wilson 95 % bands."""
    from matplotlib.figure import Figure

    conditions = summary["conditions"]
    figure = Figure(figsize=(5.0 * len(conditions), 3.6), layout="constrained")
    axes = figure.subplots(1, len(conditions), squeeze=False, sharey=True)[0]
    for ax, (name, both) in zip(axes, conditions.items(), strict=True):
        for key, curve in both["synthetic"]["found"].items():
            kind, push = key.split()
            forces = [float(f) for f in curve]
            ax.plot(forces, [r["rate"] for r in curve.values()], "-" if push == "step" else "--",
                    color=COLOURS[kind], marker=".", label=key)  # fmt: skip
            ax.fill_between(forces, [r["lo"] for r in curve.values()], [r["hi"] for r in curve.values()],
                            color=COLOURS[kind], alpha=0.08)  # fmt: skip
        alarms = both["synthetic"]["false_alarms"]
        hours = "  ".join(f"{k} {r['count']}/{r['hours']:.1f} h" for k, r in alarms.items())
        ax.set_title(f"{name}; false alarms: {hours}", fontsize=8)
        ax.set_xlabel("push, N")
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("share found")
    axes[-1].legend(fontsize=7)
    figure.savefig(path, dpi=130)
