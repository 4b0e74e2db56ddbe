"""Run `bench search`: exploration by each policy, in MuJoCo and in the planar simulator."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.bench.planar import BUDGET_M
from glotouch_bt.bench.search.plots import plot_discovered, plot_layout
from glotouch_bt.bench.search.scoring import discovered_at
from glotouch_bt.bench.search.summary import COMPLETE_AT_M, MEAN_AT_M, summarise
from glotouch_bt.bench.search.trial import (
    mission_trial,
    planar_trials,
    recorded_folders,
    recorded_trial,
    scene,
    sections_of,
)
from glotouch_bt.perception.search import POLICIES
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import RunRequest

CHUNK = 25
"""Number of planar layouts in one task."""
COLUMNS = (
    "simulator", "policy", "seed", "ended", *(f"discovered_{d:g}_m" for d in MEAN_AT_M),
    *(f"complete_{d:g}_m" for d in COMPLETE_AT_M), "travel_m", "before_m", "contacts", "false_candidates",
    "discovered_at_m", "folder",
)  # fmt: skip
CANDIDATE_COLUMNS = (
    "simulator", "policy", "seed", "object", "kind", "travel_m", "centre_error_mm", "height_error_mm", "yaw_error_deg",
    "displaced_mm",
)  # fmt: skip
OnRow = Callable[[Mapping[str, Any], int, int], None]


@dataclass(frozen=True)
class SearchCampaign:
    """Settings of the campaign.

    Attributes:
        policies: Names of search policies; candidate errors are reported for the first.
        seeds: Seeds of the mission trials; the planar simulator explores the same layouts.
        planar_seeds: Seeds of further layouts for the planar simulator alone.
        conditions: Path or shipped name.
        objects: Folder of STL files instead of the world's.
        backend: Registered name of a simulation.
        out: Folder of the campaign; it receives a run folder for each mission.
        mission: Path or shipped name; it must take a parameter `policy`.
        resume: Score missions whose folders are complete instead of running them again.
        recorded: Folders searched for recorded runs, which are scored too.
        planar_budget_m: Travel at which planar explorations stop.
    """

    policies: tuple[str, ...]
    seeds: tuple[int, ...]
    planar_seeds: tuple[int, ...]
    conditions: str
    objects: Path | None
    backend: str
    out: Path
    mission: str = "survey"
    planar_budget_m: float = BUDGET_M
    resume: bool = False
    recorded: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        unknown = [p for p in self.policies if p not in POLICIES]
        if unknown or not self.policies:
            raise BadInput(f"--policies {','.join(unknown)}: must be among {', '.join(POLICIES)}")
        if not self.seeds and not self.planar_seeds and not self.recorded:
            raise BadInput("nothing to try: give --trials, --planar or --recorded")

    def folder(self, policy: str, seed: int) -> Path:
        """Return the run folder of a trial."""
        return self.out / f"{policy}-s{seed}"

    def request(self, policy: str, seed: int) -> RunRequest:
        """Return the mission request of a trial."""
        return RunRequest(
            mission=self.mission,
            backend=self.backend,
            seed=seed,
            settings={"policy": policy, "expected_objects": str(self.object_count)},
            objects=self.objects,
            conditions=self.conditions,
            out=self.folder(policy, seed),
        )

    @property
    def object_count(self) -> int:
        """Return the number of objects in a layout."""
        return len(scene(self.mission, self.objects)[1])


def run_campaign(campaign: SearchCampaign, executor: Executor, on_row: OnRow | None = None) -> dict[str, Any]:
    """Run every trial, write trials.csv, candidates.csv, plots and summary.json, and return the summary.

    Args:
        campaign: Settings.
        executor: Any `concurrent.futures` executor.
        on_row: Called with (row, done, total) after each trial.

    Raises:
        BadInput: The objects cannot be used or do not fit.
    """
    objects = campaign.object_count
    campaign.out.mkdir(parents=True, exist_ok=True)
    rows = _run(campaign, executor, on_row)
    order = {p: i for i, p in enumerate((*campaign.policies, *sorted(POLICIES)))}
    rows.sort(key=lambda r: (r["simulator"], order.get(r["policy"], len(order)), r["seed"]))
    _write_csv(campaign, rows, objects)
    figures: dict[str, Any] = _finite(summarise(rows, campaign.policies, objects))
    summary = figures | {
        "conditions": campaign.conditions,
        "seeds": sorted({r["seed"] for r in rows if r["simulator"] != "planar"}),
        "planar_seeds": _span(campaign.planar_seeds),
        "objects": objects,
        "mission": campaign.mission,
        "backend": campaign.backend,
    }
    (campaign.out / "summary.json").write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n")
    plot_discovered(campaign.out / "discovered.png", rows, campaign.policies, objects)
    if campaign.seeds:
        example = campaign.folder(campaign.policies[0], campaign.seeds[0])
        if (example / "run.mcap").is_file():
            plot_layout(campaign.out / "layout.png", example, sections_of(campaign.mission, campaign.objects))
    return summary


def _run(campaign: SearchCampaign, executor: Executor, on_row: OnRow | None) -> list[dict[str, Any]]:
    """Run missions first, seeds outermost: an interrupted campaign has all policies on the same layouts."""
    runs = [f for top in campaign.recorded for f in recorded_folders(top, Path(campaign.conditions).stem)]
    plane = tuple(dict.fromkeys(campaign.seeds + campaign.planar_seeds))
    budget = campaign.planar_budget_m
    futures: list[Future[Any]] = [
        executor.submit(mission_trial, campaign.request(policy, seed), policy, campaign.resume)
        for seed in campaign.seeds
        for policy in campaign.policies
    ]
    futures += [
        executor.submit(recorded_trial, folder, campaign.mission, campaign.objects, campaign.policies[0])
        for folder in runs
    ]
    futures += [
        executor.submit(planar_trials, campaign.mission, campaign.objects, policy, plane[k : k + CHUNK], budget)
        for k in range(0, len(plane), CHUNK)
        for policy in campaign.policies
    ]
    total = len(campaign.policies) * (len(campaign.seeds) + len(plane)) + len(runs)
    rows: list[dict[str, Any]] = []
    try:
        for future in as_completed(futures):
            result = future.result()
            for row in result if isinstance(result, list) else [result]:
                rows.append(row)
                if on_row is not None:
                    on_row(row, len(rows), total)
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return rows


def _finite(value: Any) -> Any:
    """Replace non-finite numbers by None, for JSON."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _span(seeds: Sequence[int]) -> dict[str, int] | None:
    return {"first": seeds[0], "count": len(seeds)} if seeds else None


def _write_csv(campaign: SearchCampaign, rows: Sequence[Mapping[str, Any]], objects: int) -> None:
    with (campaign.out / "trials.csv").open("w", newline="") as f:
        table = csv.DictWriter(f, COLUMNS, extrasaction="ignore")
        table.writeheader()
        for r in rows:
            line: dict[str, Any] = {f"discovered_{d:g}_m": discovered_at(r, d) for d in MEAN_AT_M}
            line |= {f"complete_{d:g}_m": int(discovered_at(r, d) >= objects) for d in COMPLETE_AT_M}
            line["discovered_at_m"] = " ".join(f"{t:.4f}" for t in r["discovered_m"])
            line["folder"] = (
                "" if r["simulator"] == "planar" else r.get("folder") or campaign.folder(r["policy"], r["seed"]).name
            )
            table.writerow(dict(r) | line)
    with (campaign.out / "candidates.csv").open("w", newline="") as f:
        table = csv.DictWriter(f, CANDIDATE_COLUMNS, extrasaction="ignore")
        table.writeheader()
        for r in rows:
            where = {k: r[k] for k in ("simulator", "policy", "seed")}
            table.writerows(c | where for c in r["candidates"])
