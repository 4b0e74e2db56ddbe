"""Run `bench search`: exploration by each policy, in MuJoCo and in the planar simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.bench.search.plots import plot_discovered, plot_layout
from glotouch_bt.bench.search.scoring import discovered_at
from glotouch_bt.bench.search.summary import COMPLETE_AT_M, MEAN_AT_M, summarise
from glotouch_bt.bench.search.trial import (
    failed_trial,
    mission_trial,
    planar_trial,
    recorded_folders,
    recorded_trial,
    scene,
    sections_of,
)
from glotouch_bt.campaign import (
    Campaign,
    OnRow,
    Row,
    Trial,
    digest,
    run_trials,
    silent,
    write_summary,
    write_table,
)
from glotouch_bt.escaped_text import finite
from glotouch_bt.mission.read import conditions_name
from glotouch_bt.perception.search import policy_names
from glotouch_bt.robot import BadInput

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
        planar_budget_m: Travel at which planar explorations stop; None: in proportion to the objects and the floor.
    """

    mission: str = "survey"
    policies: tuple[str, ...]
    planar_seeds: tuple[int, ...] = ()
    recorded: tuple[Path, ...] = ()
    planar_budget_m: float | None = None

    def __post_init__(self) -> None:
        known = policy_names()
        unknown = [p for p in self.policies if p not in known]
        if unknown or not self.policies:
            raise BadInput(f"--policies {','.join(unknown)}: must be among {', '.join(known)}")
        if not self.seeds and not self.planar_seeds and not self.recorded:
            raise BadInput("nothing to try: give --trials, --planar or --recorded")

    def mission_trial(self, policy: str, seed: int) -> Trial:
        """Return the mission trial of a policy."""
        settings = {"policy": policy, "expected_objects": str(self.object_count)}
        request = self.request(seed, f"{policy}-s{seed}", settings=settings)
        head = {"simulator": self.backend, "policy": policy, "seed": seed}
        return Trial.of(request, partial(mission_trial, head, request), partial(failed_trial, head))

    def planar_trial(self, policy: str, seed: int) -> Trial:
        """Return the trial of a policy in the planar simulator."""
        head = {"simulator": "planar", "policy": policy, "seed": seed}
        run = partial(planar_trial, head, self.mission, self.objects, self.world, self.planar_budget_m)
        return self.trial(
            f"planar/{policy}-s{seed}", run, partial(failed_trial, head), **head, budget=self.planar_budget_m
        )

    def recorded_trial(self, number: int, folder: Path) -> Trial:
        """Return the trial that scores a recorded run."""
        head = {"simulator": "recorded", "policy": self.policies[0], "seed": -1, "folder": str(folder)}
        run = partial(recorded_trial, folder, self.mission, self.objects, self.world, self.policies[0])
        content = {name: digest((folder / name).read_bytes()) for name in ("result.json", "truth.json")}
        return self.trial(f"recorded/{number}", run, partial(failed_trial, head), **head, content=content)

    def trials(self) -> list[Trial]:
        """Return missions first, seeds outermost: an interrupted campaign has all policies on the same layouts."""
        runs = [f for top in self.recorded for f in recorded_folders(top, conditions_name(self.conditions))]
        plane = dict.fromkeys((*self.seeds, *self.planar_seeds))
        return [
            *(self.mission_trial(policy, seed) for seed in self.seeds for policy in self.policies),
            *(self.recorded_trial(n, folder) for n, folder in enumerate(runs)),
            *(self.planar_trial(policy, seed) for seed in plane for policy in self.policies),
        ]

    @property
    def object_count(self) -> int:
        """Return the number of objects in a layout."""
        return len(scene(self.mission, self.objects, self.world)[1])


def run_campaign(campaign: SearchCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every trial, write trials.csv, candidates.csv, plots and summary.json, and return the summary.

    Raises:
        BadInput: The objects cannot be used or do not fit.
    """
    objects = campaign.object_count
    order = {p: i for i, p in enumerate((*campaign.policies, *sorted(policy_names())))}

    def place(row: Mapping[str, Any]) -> tuple[str, int, int]:
        return row["simulator"], order.get(row["policy"], len(order)), row["seed"]

    def write(rows: Sequence[Row]) -> None:
        _write_csv(campaign, sorted(rows, key=place), objects)

    rows = sorted(run_trials(executor, campaign.trials(), campaign, on_row, write=write), key=place)
    figures: dict[str, Any] = finite(summarise(rows, campaign.policies, objects))
    planar = campaign.planar_seeds
    summary = figures | {
        **campaign.described(),
        "seeds": sorted({r["seed"] for r in rows if r["simulator"] != "planar"}),
        "planar_seeds": {"first": planar[0], "count": len(planar)} if planar else None,
        "objects": objects,
        "backend": campaign.backend,
    }
    summary = write_summary(campaign.out, summary)
    plot_discovered(campaign.out / "discovered.png", rows, campaign.policies, objects)
    if campaign.seeds:
        example = campaign.out / f"{campaign.policies[0]}-s{campaign.seeds[0]}"
        if (example / "run.mcap").is_file():
            sections = sections_of(campaign.mission, campaign.objects, campaign.world)
            plot_layout(campaign.out / "layout.png", example, sections)
    return summary


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
