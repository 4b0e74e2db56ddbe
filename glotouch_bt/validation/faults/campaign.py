"""Run `bench faults`: every class of fault in every skill it can affect, each trial compared with its unfaulted twin.

The twins (one a seed, shared by all classes) run first. They show which skills run and for how long, so that each fault
begins at its own moment inside the skill. Seeds whose twin fails are counted separately.
"""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.faults import FaultPlan
from glotouch_bt.robot import BadInput, Limits, ObjectSet
from glotouch_bt.robot.scene import load_folder
from glotouch_bt.runs import RunRequest
from glotouch_bt.validation.faults.cases import Case
from glotouch_bt.validation.faults.plots import plot_matrix
from glotouch_bt.validation.faults.summary import summarise
from glotouch_bt.validation.faults.trial import drawn_after_s, run_trial

COLUMNS = (
    "class", "skill", "seed", "verdict", "effective", "after_s", "status", "cause", "named", "seen_by", "seen_code",
    "latency_s", "recovery", "applied", "changes", "moved_m", "retrieved", "correct", "peak_force_N", "sim_s", "wall_s",
    "rejoined", "twin_ok", "folder",
)  # fmt: skip
OnRow = Callable[[Mapping[str, Any], int, int], None]


@dataclass(frozen=True)
class FaultCampaign:
    """Settings of the campaign.

    Attributes:
        mission: Path or shipped name; it takes the settings.
        settings: Mission parameters of every trial.
        cases: Classes of faults.
        skills: Skills to break, by node name.
        seeds: Seeds of the trials.
        conditions: Path or shipped name.
        objects: Folder of STL files instead of the world's.
        backend: Registered name.
        out: Folder of the campaign; it receives a run folder for each trial.
        resume: Keep existing trials.
        keep: Keep the records of trials that ended well.
    """

    mission: str
    settings: Mapping[str, str]
    cases: tuple[Case, ...]
    skills: tuple[str, ...]
    seeds: tuple[int, ...]
    conditions: str
    objects: Path | None
    backend: str
    out: Path
    resume: bool = False
    keep: bool = False

    def request(self, seed: int, name: str, plan: FaultPlan) -> RunRequest:
        """Return the run request of a trial."""
        return RunRequest(
            mission=self.mission,
            backend=self.backend,
            seed=seed,
            settings=self.settings,
            objects=self.objects,
            conditions=self.conditions,
            out=self.out / name,
            faults=plan,
            report=False,
        )


def few_objects(objects: ObjectSet, count: int, folder: Path) -> tuple[Path, tuple[str, ...]]:
    """Copy the first `count` objects of a world to a folder; return it and their names.

    Raises:
        BadInput: The world's objects cannot be read, or the folder not be written.
    """
    names = tuple(m.name for m in load_folder(objects.folder, objects.names))[:count]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copyfile(objects.folder / f"{name}.stl", folder / f"{name}.stl")
    except OSError as e:
        raise BadInput(f"{folder}: the objects cannot be copied there ({e.strerror})") from e
    return folder, names


def run_campaign(campaign: FaultCampaign, executor: Executor, on_row: OnRow | None = None) -> dict[str, Any]:
    """Run twins, then trials, write trials.csv, matrix.png and summary.json, and return the summary.

    Args:
        campaign: Settings.
        executor: Any `concurrent.futures` executor.
        on_row: Called with (row, done, total) after each trial.
    """
    campaign.out.mkdir(parents=True, exist_ok=True)
    hard_force_N = Limits().hard_force_N
    cells = [(c, s) for c in campaign.cases for s in campaign.skills if s in c.skills]
    total = len(campaign.seeds) * (1 + len(cells))
    rows: list[dict[str, Any]] = []

    def gather(futures: Sequence[Future[dict[str, Any]]]) -> list[dict[str, Any]]:
        done: list[dict[str, Any]] = []
        try:
            for future in as_completed(futures):
                done.append(future.result())
                rows.append(done[-1])
                if on_row is not None:
                    on_row(done[-1], len(rows), total)
        except BaseException:
            for future in futures:
                future.cancel()
            raise
        return done

    def submit(seed: int, name: str, plan: FaultPlan, labels: Mapping[str, Any]) -> Future[dict[str, Any]]:
        request = campaign.request(seed, name, plan)
        twin = campaign.out / f"twin-s{seed}" if plan.faults else None
        return executor.submit(run_trial, request, labels, hard_force_N, campaign.resume, campaign.keep, twin)

    nothing = FaultPlan("none", ())
    twins = {
        row["seed"]: row
        for row in gather(
            [submit(s, f"twin-s{s}", nothing, {"class": "none", "skill": "", "seed": s}) for s in campaign.seeds]
        )
    }
    futures, not_reached = [], 0
    for seed in campaign.seeds:
        lasted = twins[seed].get("durations_s", {})
        for case, skill in cells:
            if skill not in lasted:
                not_reached += 1
                continue
            after_s = drawn_after_s(seed, case.fault, skill, lasted[skill])
            labels = {"class": case.fault, "skill": skill, "seed": seed, "after_s": after_s}
            labels["twin_ok"] = twins[seed]["verdict"] == "recovered"
            futures.append(submit(seed, f"{case.fault}-{skill}-s{seed}", case.plan(skill, after_s), labels))
    gather(futures)
    rows.sort(key=lambda r: (str(r["class"]), str(r["skill"]), r["seed"]))
    return _written(campaign, rows, not_reached)


def _written(campaign: FaultCampaign, rows: list[dict[str, Any]], not_reached: int) -> dict[str, Any]:
    with (campaign.out / "trials.csv").open("w", newline="", encoding="utf-8") as f:
        table = csv.DictWriter(f, COLUMNS, extrasaction="ignore")
        table.writeheader()
        table.writerows(r | {"recovery": " ".join(r.get("recovery", ()))} for r in rows)
    summary = summarise(rows) | {
        "not_reached": not_reached,
        "mission": campaign.mission,
        "settings": dict(campaign.settings),
        "conditions": campaign.conditions,
        "seeds": list(campaign.seeds),
        "skills": list(campaign.skills),
        "classes": [c.fault for c in campaign.cases],
        "backend": campaign.backend,
        "hard_force_N": Limits().hard_force_N,
    }
    text = json.dumps(summary, indent=2, allow_nan=False)
    (campaign.out / "summary.json").write_text(text + "\n", encoding="utf-8")
    plot_matrix(campaign.out / "matrix.png", rows, [c.fault for c in campaign.cases], campaign.skills)
    return summary
