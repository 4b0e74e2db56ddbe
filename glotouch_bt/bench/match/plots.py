"""Plots of `bench match`: ablation, reliability, losses, separation, closures to confidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from glotouch_bt.bench.search import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Row = Mapping[str, Any]


def plot_all(folder: Path, summary: Mapping[str, Any], trials: Sequence[Row], closures: Sequence[Row]) -> None:
    """Write top1.png, losses.png, reliability.png and closures.png into a folder."""
    title = f"{summary['layouts']} layouts, {summary['conditions']}"
    figure, (axes,) = _figure(7.5, 4.2)
    _top1(axes, summary)
    axes.set_title(title, fontsize=9)
    figure.savefig(folder / "top1.png", dpi=130)

    shown = [n for n in ("paper_full", summary["head"]) if n in summary["methods"]]
    figure, panels = _figure(4.4 * len(shown), 4.2, len(shown))
    for axes, name in zip(panels, shown, strict=True):
        _losses(axes, summary["loss_matrix"]["objects"], summary["loss_matrix"][name], name)
    figure.savefig(folder / "losses.png", dpi=130)

    figure, panels = _figure(9.0, 4.2, 2)
    _reliability(panels[0], summary)
    _scores(panels[1], [t for t in trials if t["method"] == summary["head"]], summary)
    figure.savefig(folder / "reliability.png", dpi=130)

    if closures:
        figure, (axes,) = _figure(7.0, 4.2)
        _closures(axes, [c for c in closures if c["present"]])
        axes.set_title(title, fontsize=9)
        figure.savefig(folder / "closures.png", dpi=130)


def _figure(width: float, height: float, panels: int = 1) -> tuple[Figure, list[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(np.atleast_1d(figure.subplots(1, panels)))


def _top1(axes: Axes, summary: Mapping[str, Any]) -> None:
    """Draw row and column Top-1 of each method with Wilson whiskers, and the paper's row figures."""
    names = list(summary["methods"])
    for k, (key, label) in enumerate((("row_top1", "row"), ("col_top1", "column"))):
        rates = [summary["methods"][n][key] for n in names]
        at = np.arange(len(names)) + 0.3 * (k - 0.5)
        value = np.array([np.nan if r["rate"] is None else r["rate"] for r in rates])
        span = np.array([[v - r["lo"], r["hi"] - v] for v, r in zip(value, rates, strict=True)]).T
        axes.bar(at, 100 * value, 0.28, color=COLOURS[k], label=label, yerr=100 * np.clip(span, 0, 1), capsize=3)
    paper = [(i, summary["paper"][n]["row_top1"]) for i, n in enumerate(names) if n in summary["paper"]]
    if paper:
        axes.plot(
            [i - 0.15 for i, _ in paper], [100 * r for _, r in paper], "k_", ms=22, mew=2, label="the paper's row"
        )
    axes.set(ylabel="Top-1 [%]", ylim=(0, 104))
    axes.set_xticks(range(len(names)), names)
    axes.grid(axis="y", alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")


def _losses(axes: Axes, names: Sequence[str], matrix: Sequence[Sequence[float | None]], title: str) -> None:
    values = np.array([[np.nan if v is None else v for v in row] for row in matrix], dtype=np.float64)
    axes.set_title(f"mean loss, {title}", fontsize=9)
    axes.set(xlabel="object touched", ylabel="target STL")
    axes.set_xticks(range(len(names)), names, rotation=30, ha="right")
    axes.set_yticks(range(len(names)), names)
    if not values.size:
        return
    axes.imshow(values, cmap="viridis_r")
    dark = np.nanmean(values) if np.isfinite(values).any() else 0.0
    for (i, j), v in np.ndenumerate(values):
        axes.annotate(f"{v:.2f}", (j, i), ha="center", va="center", fontsize=8, color="w" if v > dark else "k")


def _reliability(axes: Axes, summary: Mapping[str, Any]) -> None:
    """Draw the share correct against the stated probability; dot area is proportional to the bin's count."""
    for name, colour in zip(summary["methods"], COLOURS * (1 + len(summary["methods"]) // len(COLOURS)), strict=False):
        ece = summary["methods"][name]["ece"]
        if not ece["bins"]:
            continue
        p, hit, n = (np.array([b[k] for b in ece["bins"]]) for k in ("confidence", "right", "n"))
        axes.plot(p, hit, "-", color=colour, lw=1, alpha=0.6)
        axes.scatter(p, hit, s=8 + 120 * n / n.sum(), color=colour, label=f"{name}, ECE {ece['value']:.3f}")
    axes.plot([0, 1], [0, 1], "k:", lw=1)
    axes.set(xlabel="probability of the likeliest answer", ylabel="share correct", xlim=(0, 1.02), ylim=(-0.02, 1.04))
    axes.set_title("targets present and absent alike", fontsize=9)
    axes.grid(alpha=0.3)
    if axes.collections:
        axes.legend(fontsize=7, loc="upper left")


def _scores(axes: Axes, trials: Sequence[Row], summary: Mapping[str, Any]) -> None:
    """Draw 1 - p_absent by kind of trial."""
    edges = np.linspace(0, 1, 21).tolist()
    for kind, colour in zip(("present", "absent", "stranger"), COLOURS, strict=False):
        p = np.array([1 - t["p_absent"] for t in trials if t["kind"] == kind])
        if p.size:
            axes.hist(
                p, edges, weights=np.full(p.size, 100 / p.size), histtype="step", color=colour, lw=1.6, label=kind
            )
    axes.set(xlabel="1 - p_absent", ylabel="share of decisions [%]", ylim=(0, 104))
    axes.set_title(f"{summary['head']}: is the target there?", fontsize=9)
    axes.grid(alpha=0.3)
    if axes.patches:
        axes.legend(fontsize=8)


def _closures(axes: Axes, closures: Sequence[Row]) -> None:
    """Draw the share of confident and correct decisions against the number of closures."""
    most = max((c["recorded"] for c in closures), default=1)
    at = np.arange(most + 1)
    for order, colour in zip(dict.fromkeys(c["order"] for c in closures), COLOURS, strict=False):
        mine = [c for c in closures if c["order"] == order]
        sure = np.array([c["closures"] if c["confident"] and c["right"] else np.inf for c in mine])
        share = (sure[None] <= at[:, None]).mean(axis=1)
        mean = np.mean([c["closures"] for c in mine])
        axes.step(at, 100 * share, where="post", color=colour, label=f"{order}, mean {mean:.1f} closures")
    axes.set(
        xlabel="closures in the whole box", ylabel="accepted, P > .95 and correct [%]", ylim=(0, 104), xlim=(0, most)
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")
