"""Run `bench faults`: every class of fault in every skill it can affect, each trial compared with its unfaulted twin.

The twins (one a seed, shared by all classes) run first. They show which skills run and for how long, so that each fault
begins at its own moment inside the skill. Seeds whose twin fails are counted separately.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import Campaign, OnRow, Row, Trial, run_trials, silent, write_summary, write_table
from glotouch_bt.escaped_text import finite
from glotouch_bt.faults import FaultPlan
from glotouch_bt.robot import BadInput, Limits, ObjectSet
from glotouch_bt.robot.scene import load_folder, stl_files
from glotouch_bt.validation.faults.cases import Case
from glotouch_bt.validation.faults.plots import plot_matrix
from glotouch_bt.validation.faults.summary import summarise
from glotouch_bt.validation.faults.trial import drawn_after_s, failed_trial, run_trial

COLUMNS = (
    "class", "skill", "seed", "verdict", "effective", "after_s", "status", "cause", "named", "seen_by", "seen_code",
    "latency_s", "recovery", "applied", "changes", "moved_m", "retrieved", "correct", "peak_force_N", "sim_s", "wall_s",
    "rejoined", "twin_ok", "folder",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class FaultCampaign(Campaign):
    """Settings of the campaign.

    Attributes:
        cases: Classes of faults.
        skills: Skills to break, by node name.
        keep: Keep the records of trials that ended well.
    """

    cases: tuple[Case, ...]
    skills: tuple[str, ...]
    keep: bool = False


def few_objects(objects: ObjectSet, count: int, folder: Path) -> tuple[Path, tuple[str, ...]]:
    """Copy the first `count` objects of a world to a folder; return it and their names.

    Raises:
        BadInput: The world's objects cannot be read, or the folder holds other ones or cannot be written.
    """
    names = tuple(m.name for m in load_folder(objects.folder, objects.names))[:count]
    files = stl_files(objects.folder)
    there = stl_files(folder) if folder.is_dir() else {}
    other = [n for n, path in there.items() if n not in names or path.read_bytes() != files[n].read_bytes()]
    if other:
        raise BadInput(f"{folder}: holds other objects ({', '.join(other)}); give the same options, or another --out")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copyfile(files[name], folder / f"{name}.stl")
    except OSError as e:
        raise BadInput(f"{folder}: the objects cannot be copied there ({e.strerror})") from e
    return folder, names


def run_campaign(campaign: FaultCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run twins, then trials, write trials.csv, matrix.png and summary.json, and return the summary."""
    campaign.out.mkdir(parents=True, exist_ok=True)
    hard_force_N = Limits().hard_force_N
    cells = [(c, s) for c in campaign.cases for s in campaign.skills if s in c.skills]

    def trial(seed: int, name: str, plan: FaultPlan, labels: Mapping[str, Any]) -> Trial:
        request = campaign.request(seed, name, faults=plan, report=False)
        twin = campaign.out / f"twin-s{seed}" if plan.faults else None
        labels = {**labels, "folder": name}
        run = partial(run_trial, request, labels, hard_force_N, campaign.keep, twin)
        return Trial.of(request, run, partial(failed_trial, labels))

    nothing = FaultPlan("none", ())
    trials = [trial(s, f"twin-s{s}", nothing, {"class": "none", "skill": "", "seed": s}) for s in campaign.seeds]
    first = run_trials(executor, trials, campaign, on_row, whole=True, after=len(campaign.seeds) * len(cells))
    twins = {row["seed"]: row for row in first}
    trials, not_reached = [], 0
    for seed in campaign.seeds:
        lasted = twins[seed].get("durations_s", {})
        for case, skill in cells:
            if skill not in lasted:
                not_reached += 1
                continue
            after_s = drawn_after_s(seed, case.fault, skill, lasted[skill])
            labels = {"class": case.fault, "skill": skill, "seed": seed, "after_s": after_s}
            labels["twin_ok"] = twins[seed]["verdict"] == "recovered"
            trials.append(trial(seed, f"{case.fault}-{skill}-s{seed}", case.plan(skill, after_s), labels))

    def write(rows: Sequence[Row]) -> None:
        lines = (r | {"recovery": " ".join(r.get("recovery", ()))} for r in _in_order([*first, *rows]))
        write_table(campaign.out, "trials.csv", COLUMNS, lines)

    rows = run_trials(executor, trials, campaign, on_row, write=write, before=len(first))
    return _summary(campaign, _in_order([*first, *rows]), not_reached)


def _in_order(rows: Sequence[Row]) -> list[Row]:
    return sorted(rows, key=lambda r: (str(r["class"]), str(r["skill"]), r["seed"]))


def _summary(campaign: FaultCampaign, rows: list[Row], not_reached: int) -> dict[str, Any]:
    summary: dict[str, Any] = finite(summarise(rows)) | {
        "not_reached": not_reached,
        **campaign.described(),
        "settings": dict(campaign.settings),
        "skills": list(campaign.skills),
        "classes": [c.fault for c in campaign.cases],
        "backend": campaign.backend,
        "hard_force_N": Limits().hard_force_N,
    }
    summary = write_summary(campaign.out, summary)
    plot_matrix(campaign.out / "matrix.png", rows, [c.fault for c in campaign.cases], campaign.skills)
    return summary
