"""Run `bench robustness`: acceptance of the right object against each axis alone, on paired seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

from glotouch_bt.bench.match import DEFAULT, decide, sampled_layout
from glotouch_bt.bench.robustness.axes import AXES, changed
from glotouch_bt.bench.robustness.plot import plot_axes
from glotouch_bt.bench.statistics import bootstrap_mean
from glotouch_bt.campaign import Campaign, OnRow, crashed, run_trials, silent, write_summary, write_table
from glotouch_bt.escaped_text import finite
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_conditions

COLUMNS = ("axis", "level", "seed", "decisions", "right", "accepted", "wrong", "absent", "absent_taken", "cause")
FIGURES = ("right", "accepted", "wrong", "absent_taken")


@dataclass(frozen=True, kw_only=True)
class RobustnessCampaign(Campaign):
    """Settings of the sweep. Its mission only names the world.

    Attributes:
        axes: Names in `AXES`.
    """

    mission: str = "touch_all"
    axes: tuple[str, ...]

    def __post_init__(self) -> None:
        for axis in self.axes:
            load_conditions(changed(self.conditions, axis, AXES[axis].levels[0] if axis in AXES else 0.0))

    @property
    def points(self) -> list[tuple[str, float]]:
        """Return the (axis, level) of every point, and ("", 0.0) for the base conditions."""
        return [("", 0.0), *((axis, level) for axis in self.axes for level in AXES[axis].levels)]


def sampled_row(campaign: RobustnessCampaign, axis: str, level: float, seed: int) -> dict[str, Any]:
    """Touch a box of objects under one level, decide on every target, present and absent, and count.

    Raises:
        BadInput: The backend has no `TouchSampler`, or the objects cannot be used.
    """
    conditions = load_conditions(changed(campaign.conditions, axis, level) if axis else campaign.conditions)
    world = load_mission(campaign.mission, {}, objects=campaign.objects).world
    layout = sampled_layout(campaign.backend, world, conditions, seed)
    trials = decide(layout, world.objects.folder, None, (DEFAULT,)).trials
    present = [t for t in trials if t["kind"] == "present"]
    absent = [t for t in trials if t["kind"] == "absent"]
    return {
        "axis": axis, "level": level, "seed": seed, "decisions": len(present), "cause": "",
        "right": sum(t["right"] for t in present), "accepted": sum(t["right"] and t["accepted"] for t in present),
        "wrong": sum(t["accepted"] and not t["right"] for t in present),
        "absent": len(absent), "absent_taken": sum(t["accepted"] for t in absent),
    }  # fmt: skip


def failed_row(axis: str, level: float, seed: int, error: Exception) -> dict[str, Any]:
    """Return the row of a box whose decisions raised: one decision, not right."""
    none = dict.fromkeys(FIGURES, 0)
    cause = crashed(error)["cause"]
    return {"axis": axis, "level": level, "seed": seed, "decisions": 1, "absent": 1, **none, "cause": cause}


def run_campaign(campaign: RobustnessCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Sample every point, write points.csv, robustness.png and summary.json, and return the summary.

    Raises:
        BadInput: A setting cannot be used.
    """
    trials = [
        campaign.trial(
            f"points/{axis or 'none'}-{level:g}-s{seed}",
            partial(sampled_row, campaign, axis, level, seed),
            partial(failed_row, axis, level, seed),
            axis=axis,
            level=level,
            seed=seed,
        )
        for axis, level in campaign.points
        for seed in campaign.seeds
    ]

    write = partial(write_table, campaign.out, "points.csv", COLUMNS)
    rows = run_trials(executor, trials, campaign, on_row, write=write)
    axes: dict[str, list[dict[str, Any]]] = {}
    for axis, level in campaign.points:
        mine = [r for r in rows if (r["axis"], r["level"]) == (axis, level)]
        axes.setdefault(axis or "none", []).append({"level": level, **_figures(mine)})
    figures: dict[str, Any] = finite(
        {
            **campaign.described(),
            "backend": campaign.backend,
            "axes": axes,
            "failed": sum(bool(r["cause"]) for r in rows),
        }
    )
    figures = write_summary(campaign.out, figures)
    plot_axes(campaign.out / "robustness.png", figures)
    return figures


def _figures(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return each rate with its interval over boxes: the decisions on one box are not independent."""
    whole = {"absent_taken": "absent"}
    return {name: bootstrap_mean([r[name] / max(r[whole.get(name, "decisions")], 1) for r in rows]) for name in FIGURES}
