"""Run `bench forces`: does the true peak force stay below the hard limit whatever fails?

An undisturbed run of each mission on each backend comes first. It shows which faults the robot accepts, which nodes run
and for how long, and whether the mission ends with an object in the jaws. Its seed is fixed, so that a trial depends on
its own seed alone.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import (
    Campaign,
    OnRow,
    Row,
    Shard,
    Trial,
    open_folder,
    run_trials,
    silent,
    write_summary,
    write_table,
)
from glotouch_bt.escaped_text import finite
from glotouch_bt.faults import FaultPlan
from glotouch_bt.robot import GlotouchError
from glotouch_bt.runs import RunFolder
from glotouch_bt.validation.forces.draw import draw_plan, draw_scene
from glotouch_bt.validation.forces.following import MatrixCell
from glotouch_bt.validation.forces.summary import summarise
from glotouch_bt.validation.forces.trial import PLAN, described, failed_trial, offences, run_trial, run_twin

COLUMNS = (
    "mission", "backend", "seed", "faults", "moment", "joint", "rate_rad_s", "effective", "status", "cause",
    "peak_force_N", "felt_peak_N", "false_success", "result_written", "retrieved", "correct", "sim_s", "wall_s",
    "folder",
)  # fmt: skip
TWIN_SEED = 0
"""Seed of every undisturbed run."""


@dataclass(frozen=True)
class ForceCampaign:
    """Settings of the campaign.

    Attributes:
        scenes: One for each pair of mission and backend; they share folder, seeds, conditions and `resume`.
        keep: Keep the records of trials without offence.
        cells: Trials of the matrix of following errors, each with the number of its scene; empty for random faults.
    """

    scenes: tuple[Campaign, ...]
    keep: bool = False
    cells: tuple[tuple[MatrixCell, int], ...] = ()

    @property
    def out(self) -> Path:
        """Folder of the campaign."""
        return self.scenes[0].out

    @property
    def shard(self) -> Shard | None:
        """See `Campaign`."""
        return self.scenes[0].shard

    def open(self) -> None:
        """See `Campaign`."""
        first = self.scenes[0]
        scenes = [s.identity for s in self.scenes]
        kind = "following errors" if self.cells else "random faults"
        open_folder(self.out, first.identity | {"scenes": scenes, "set": kind}, keep=first.keeps)


@dataclass(frozen=True)
class _Planned:
    """A trial to run: first columns of its row, scene, plan, and whether a success means an object in the jaws."""

    labels: Mapping[str, Any]
    scene: Campaign
    plan: FaultPlan
    lifts: bool


def run_campaign(campaign: ForceCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run the undisturbed missions, then the trials; write trials.csv and summary.json, and return the summary.

    Raises:
        BadInput: A request is wrong, or a backend does not know the true force.
        GlotouchError: An undisturbed run crashed.
    """
    campaign.out.mkdir(parents=True, exist_ok=True)
    first = campaign.scenes[0]
    twins = _twins(campaign, executor, on_row, len(campaign.cells) or len(first.seeds))
    planned = _matrix(campaign, twins) if campaign.cells else _drawn(campaign, twins)
    trials = []
    for p in planned:
        request = p.scene.request(p.labels["seed"], p.labels["folder"], faults=p.plan, report=False)
        run = partial(run_trial, request, p.labels, p.lifts, campaign.keep)
        failed = partial(failed_trial, p.labels, campaign.out / p.labels["folder"])
        trials.append(Trial.of(request, run, failed))

    write = partial(write_table, campaign.out, "trials.csv", COLUMNS)
    rows = run_trials(executor, trials, campaign, on_row, write=write, before=len(twins))
    return _written(campaign, twins, rows, {p.labels["folder"]: p for p in planned})


def _twin_name(scene: Campaign) -> str:
    return f"undisturbed-{Path(scene.mission).stem}-{scene.backend}"


def _labels(scene: Campaign, seed: int, folder: str) -> dict[str, Any]:
    return {"mission": Path(scene.mission).stem, "backend": scene.backend, "seed": seed, "folder": folder}


def _twins(campaign: ForceCampaign, executor: Executor, on_row: OnRow, after: int) -> list[Row]:
    """Return the rows of the undisturbed runs, in the order of the scenes."""
    trials = []
    for scene in campaign.scenes:
        name = _twin_name(scene)
        labels = _labels(scene, TWIN_SEED, name) | {"faults": ""}
        request = scene.request(TWIN_SEED, name, report=False)
        failed = partial(failed_trial, labels, scene.out / name)
        trials.append(Trial.of(request, partial(run_twin, request, labels), failed))
    rows = run_trials(executor, trials, campaign, on_row, whole=True, after=after)
    for row in rows:
        if "accepted" not in row:
            raise GlotouchError(f"{row['folder']}: the run without faults did not end ({row['cause']})")
    return rows


def _drawn(campaign: ForceCampaign, twins: Sequence[Row]) -> list[_Planned]:
    planned = []
    for seed in campaign.scenes[0].seeds:
        number = draw_scene(seed, len(campaign.scenes))
        scene, twin = campaign.scenes[number], twins[number]
        plan = draw_plan(seed, twin["accepted"], twin["durations_s"], twin["sim_s"])
        planned.append(
            _Planned(_labels(scene, seed, f"s{seed}") | {"faults": described(plan)}, scene, plan, twin["lifted"])
        )
    return planned


def _matrix(campaign: ForceCampaign, twins: Sequence[Row]) -> list[_Planned]:
    planned = []
    for cell, number in campaign.cells:
        scene, plan = campaign.scenes[number], cell.plan()
        (seed,) = scene.seeds
        labels = _labels(scene, seed, f"{cell.name}-{scene.backend}") | {"faults": described(plan)}
        labels |= {"moment": cell.moment.name, "joint": cell.joint, "rate_rad_s": cell.rate_rad_s}
        planned.append(_Planned(labels, scene, plan, twins[number]["lifted"]))
    return planned


def _written(
    campaign: ForceCampaign, twins: Sequence[Row], rows: Sequence[Row], planned: Mapping[str, _Planned]
) -> dict[str, Any]:
    first = campaign.scenes[0]
    offending = []
    for row in rows:
        if what := offences(row):
            p = planned[row["folder"]]
            RunFolder(campaign.out / row["folder"]).write_text(PLAN, p.plan.as_yaml())
            command = _command(p.scene, row["seed"], campaign.out / row["folder"] / PLAN)
            offending.append(dict(row) | {"offences": what, "plan": p.plan.as_yaml(), "command": command})
    summary: dict[str, Any] = finite(summarise(rows)) | {
        "offending": offending,
        "undisturbed": [{k: t[k] for k in ("mission", "backend", "status", "peak_force_N", "wall_s")} for t in twins],
        "set": "following errors" if campaign.cells else "random faults",
        "conditions": first.conditions,
        "seeds": list(first.seeds),
        "scenes": [
            {"mission": Path(s.mission).stem, "backend": s.backend, "settings": dict(s.settings)}
            for s in campaign.scenes
        ],
    }
    return write_summary(campaign.out, summary)


def _command(scene: Campaign, seed: int, plan: Path) -> str:
    """Return the command that repeats a trial."""
    words = ["glotouch", "run", scene.mission, "--backend", scene.backend, "--seed", str(seed)]
    for name, value in scene.settings.items():
        words += ["--set", f"{name}={value}"]
    if scene.objects is not None:
        words += ["--objects", str(scene.objects)]
    return shlex.join([*words, "--conditions", scene.conditions, "--faults", str(plan)])
