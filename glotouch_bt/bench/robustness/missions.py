"""The sweep with whole missions: `bench retrieve` at every level of every axis, on the same seeds and targets."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from functools import partial
from typing import Any

from glotouch_bt.bench.retrieve import RetrieveCampaign, run_campaign, targets_of
from glotouch_bt.bench.robustness.axes import changed
from glotouch_bt.bench.robustness.bench import RobustnessCampaign
from glotouch_bt.bench.robustness.plot import plot_axes
from glotouch_bt.campaign import OnRow, Row, silent, write_summary
from glotouch_bt.escaped_text import finite
from glotouch_bt.mission import load_mission

MISSION = "retrieve"
FIGURES = ("success", "wrong_object", "safety_stops", "causes", "largest_peak_force_N", "median_sim_s")


def run_missions(campaign: RobustnessCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run one mission a seed at every point, each target in turn; write robustness.png and summary.json.

    Every point has a folder with the files of its `bench retrieve`. Returns the summary.

    Raises:
        BadInput: A setting cannot be used.
    """
    folder = load_mission(campaign.mission, {}, objects=campaign.objects).world.objects.folder
    axes: dict[str, list[Mapping[str, Any]]] = {}
    for axis, level in campaign.points:
        point = RetrieveCampaign(
            mission=MISSION,
            targets=targets_of(folder),
            per_seed=1,
            seeds=campaign.seeds,
            conditions=changed(campaign.conditions, axis, level) if axis else campaign.conditions,
            objects=campaign.objects,
            backend=campaign.backend,
            resume=campaign.resume,
            shard=campaign.shard,
            out=campaign.out / (f"{axis}_{level:g}" if axis else "none"),
        )
        found = run_campaign(point, executor, partial(_told, on_row, axis, level))
        axes.setdefault(axis or "none", []).append({"level": level, **{name: found[name] for name in FIGURES}})
    figures: dict[str, Any] = finite(
        {**campaign.described(), "mission": MISSION, "backend": campaign.backend, "axes": axes}
    )
    figures = write_summary(campaign.out, figures)
    plot_axes(campaign.out / "robustness.png", figures)
    return figures


def _told(on_row: OnRow, axis: str, level: float, row: Row, count: int, total: int) -> None:
    on_row({**row, "axis": axis, "level": level}, count, total)
