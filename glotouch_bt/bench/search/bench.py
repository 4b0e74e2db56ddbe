"""Run `bench search`: exploration by each policy, in MuJoCo and in the planar simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.bench.planar import BUDGET_M
from glotouch_bt.bench.search.plots import plot_discovered, plot_layout
from glotouch_bt.bench.search.scoring import discovered_at
from glotouch_bt.bench.search.summary import COMPLETE_AT_M, MEAN_AT_M, summarise
from glotouch_bt.bench.search.trial import (
    failed_trial,
    mission_trial,
    planar_trials,
    recorded_folders,
    recorded_trial,
    scene,
    sections_of,
)
from glotouch_bt.escaped_text import finite
from glotouch_bt.mission.read import conditions_name
from glotouch_bt.perception.search import POLICIES
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import (
    Campaign,
    OnRow,
    Row,
    Task,
    Trial,
    TrialMemory,
    gather,
    run_trials,
    silent,
    write_summary,
    write_table,
)

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


@dataclass(frozen=True, kw_only=True)
class SearchCampaign(Campaign):
    """Settings of the campaign. Its mission takes a parameter `policy`; the planar simulator explores its layouts too.

    Attributes:
        policies: Names of search policies; candidate errors are reported for the first.
        planar_seeds: Seeds of further layouts for the planar simulator alone.
        recorded: Folders searched for recorded runs, which are scored too.
        planar_budget_m: Travel at which planar explorations stop.
    """

    mission: str = "survey"
    policies: tuple[str, ...]
    planar_seeds: tuple[int, ...] = ()
    recorded: tuple[Path, ...] = ()
    planar_budget_m: float = BUDGET_M

    def __post_init__(self) -> None:
        unknown = [p for p in self.policies if p not in POLICIES]
        if unknown or not self.policies:
            raise BadInput(f"--policies {','.join(unknown)}: must be among {', '.join(POLICIES)}")
        if not self.seeds and not self.planar_seeds and not self.recorded:
            raise BadInput("nothing to try: give --trials, --planar or --recorded")

    def trial(self, policy: str, seed: int) -> Trial:
        """Return the mission trial of a policy."""
        settings = {"policy": policy, "expected_objects": str(self.object_count)}
        request = self.request(seed, f"{policy}-s{seed}", settings=settings)
        head = {"simulator": self.backend, "policy": policy, "seed": seed}
        return Trial(partial(mission_trial, head, request), partial(failed_trial, head), TrialMemory(request))

    @property
    def object_count(self) -> int:
        """Return the number of objects in a layout."""
        return len(scene(self.mission, self.objects)[1])


def run_campaign(campaign: SearchCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every trial, write trials.csv, candidates.csv, plots and summary.json, and return the summary.

    Raises:
        BadInput: The objects cannot be used or do not fit.
    """
    objects = campaign.object_count
    rows = _run(campaign, executor, on_row)
    order = {p: i for i, p in enumerate((*campaign.policies, *sorted(POLICIES)))}
    rows.sort(key=lambda r: (r["simulator"], order.get(r["policy"], len(order)), r["seed"]))
    _write_csv(campaign, rows, objects)
    figures: dict[str, Any] = finite(summarise(rows, campaign.policies, objects))
    planar = campaign.planar_seeds
    summary = figures | {
        **campaign.described(),
        "seeds": sorted({r["seed"] for r in rows if r["simulator"] != "planar"}),
        "planar_seeds": {"first": planar[0], "count": len(planar)} if planar else None,
        "objects": objects,
        "backend": campaign.backend,
    }
    write_summary(campaign.out, summary)
    plot_discovered(campaign.out / "discovered.png", rows, campaign.policies, objects)
    if campaign.seeds:
        example = campaign.out / f"{campaign.policies[0]}-s{campaign.seeds[0]}"
        if (example / "run.mcap").is_file():
            plot_layout(campaign.out / "layout.png", example, sections_of(campaign.mission, campaign.objects))
    return summary


def _run(campaign: SearchCampaign, executor: Executor, on_row: OnRow) -> list[dict[str, Any]]:
    """Run missions first, seeds outermost: an interrupted campaign has all policies on the same layouts."""
    runs = [f for top in campaign.recorded for f in recorded_folders(top, conditions_name(campaign.conditions))]
    plane = tuple(dict.fromkeys((*campaign.seeds, *campaign.planar_seeds)))
    mission, objects, budget = campaign.mission, campaign.objects, campaign.planar_budget_m
    trials = [campaign.trial(policy, seed) for seed in campaign.seeds for policy in campaign.policies]
    others: list[Task[list[Row]]] = []
    for folder in runs:
        head = {"simulator": "recorded", "policy": campaign.policies[0], "seed": -1, "folder": str(folder)}
        run = partial(recorded_trial, folder, mission, objects, campaign.policies[0])
        others.append(Task(run, partial(_all_failed, [head])))
    for k in range(0, len(plane), CHUNK):
        for policy in campaign.policies:
            seeds = plane[k : k + CHUNK]
            heads = [{"simulator": "planar", "policy": policy, "seed": seed} for seed in seeds]
            run = partial(planar_trials, mission, objects, policy, seeds, budget)
            others.append(Task(run, partial(_all_failed, heads)))
    total = len(campaign.policies) * (len(campaign.seeds) + len(plane)) + len(runs)
    rows = run_trials(executor, trials, campaign.resume, lambda row, n, _: on_row(row, n, total))

    def add(found: list[Row], *_: int) -> None:
        for row in found:
            rows.append(row)
            on_row(row, len(rows), total)

    gather(executor, others, add)
    return rows


def _all_failed(heads: Sequence[Row], error: Exception) -> list[Row]:
    return [failed_trial(head, error) for head in heads]


def _write_csv(campaign: SearchCampaign, rows: Sequence[Mapping[str, Any]], objects: int) -> None:
    lines = []
    for r in rows:
        line = dict(r) | {f"discovered_{d:g}_m": discovered_at(r, d) for d in MEAN_AT_M}
        line |= {f"complete_{d:g}_m": int(discovered_at(r, d) >= objects) for d in COMPLETE_AT_M}
        line["discovered_at_m"] = " ".join(f"{t:.4f}" for t in r["discovered_m"])
        line["folder"] = "" if r["simulator"] == "planar" else r.get("folder") or f"{r['policy']}-s{r['seed']}"
        lines.append(line)
    write_table(campaign.out, "trials.csv", COLUMNS, lines)
    keys = ("simulator", "policy", "seed")
    candidates = (c | {k: r[k] for k in keys} for r in rows for c in r["candidates"])
    write_table(campaign.out, "candidates.csv", CANDIDATE_COLUMNS, candidates)
