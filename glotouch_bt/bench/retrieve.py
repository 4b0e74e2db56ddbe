"""`bench retrieve`: the whole mission over targets and seeds; every trial counts."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.bench.statistics import bootstrap_mean, wilson
from glotouch_bt.campaign import (
    Campaign,
    OnRow,
    Row,
    Trial,
    crashed,
    launch_trial,
    run_trials,
    silent,
    write_summary,
    write_table,
)
from glotouch_bt.robot.scene import load_folder
from glotouch_bt.runs import RunRequest

COLUMNS = (
    "target", "seed", "exit_code", "status", "retrieved", "correct", "cause", "candidates", "contacts", "probe_path_m",
    "peak_force_N", "true_samples_over_limit", "contact_softness_s", "others_lifted", "sim_time_s",
    "wall_time_s", "folder",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class RetrieveCampaign(Campaign):
    """Settings of the campaign; its mission takes a parameter `target`.

    Attributes:
        targets: Names of objects in the folder.
        per_seed: How many of them are tried on each seed, in turn; None: all.
    """

    targets: tuple[str, ...]
    per_seed: int | None = None

    def trials(self) -> list[Trial]:
        """Return every trial, seeds outermost: an interrupted campaign covers all targets."""
        n = len(self.targets)
        count = n if self.per_seed is None else min(self.per_seed, n)
        return [
            self._trial(self.targets[(i * count + k) % n], seed)
            for i, seed in enumerate(self.seeds)
            for k in range(count)
        ]

    def _trial(self, target: str, seed: int) -> Trial:
        request = self.request(seed, f"{target}-s{seed}", settings={**self.settings, "target": target})
        head = {"target": target, "seed": seed, "folder": f"{target}-s{seed}"}
        return Trial.of(request, partial(run_trial, head, request), partial(_failed, head))


def targets_of(folder: Path) -> tuple[str, ...]:
    """Return the names of the usable STLs of a folder.

    Raises:
        BadInput: None, or an unusable one.
    """
    return tuple(m.name for m in load_folder(folder))


def run_trial(head: Row, request: RunRequest) -> Row:
    """Run one trial in this process and return its row, which begins with the columns `head`."""
    done = launch_trial(request)
    found = {
        "skill_time_s": done.result["skill_time_s"],
        "candidates": len(done.result["candidates"]),
        "cause": cause(done.result),
        "others_lifted": others_lifted(done.result),
        "exit_code": done.exit_code,
    }
    return head | {k: done.result[k] for k in COLUMNS if k in done.result} | found


def _failed(head: Row, error: Exception) -> Row:
    return head | crashed(error)


def cause(result: Mapping[str, Any]) -> str:
    """Return the cause of failure: node and code of the root reason, or `wrong_object`; empty for a success."""
    if result["status"] == "success":
        if result["correct"]:
            return ""
        return "wrong_object" if result["retrieved"] else "nothing_in_gripper"
    chain = result["reason_chain"]
    if not chain:
        return str(result["status"])
    root = chain[-1]
    return f"{root['node'].rsplit('/', 1)[-1]}: {root['code'] or 'failed'}"


def others_lifted(result: Mapping[str, Any]) -> str:
    """Return the objects besides the target that were ever lifted: by mistake, or as neighbours to make space."""
    names = {lift["object"] for lift in result.get("lifted", ())} - {result.get("target"), None}
    return ";".join(sorted(names))


def run_campaign(campaign: RetrieveCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every trial on the executor, write trials.csv and summary.json, and return the summary."""
    rows = run_trials(executor, campaign.trials(), campaign, on_row, write=partial(_write, campaign.out))
    more = {"targets": list(campaign.targets), "backend": campaign.backend, "settings": dict(campaign.settings)}
    summary = summarise(rows) | campaign.described() | more
    return write_summary(campaign.out, summary)


def _write(folder: Path, rows: Sequence[Row]) -> None:
    write_table(folder, "trials.csv", COLUMNS, sorted(rows, key=lambda r: (r["target"], r["seed"])))


def succeeded(row: Mapping[str, Any]) -> bool:
    """Return True if the mission succeeded and the right object is really in the gripper."""
    return row.get("status") == "success" and bool(row.get("correct"))


def summarise(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return rates with Wilson and means with bootstrap intervals over all rows; failures count."""
    n = len(rows)
    wrong = sum(bool(r.get("retrieved")) and not r.get("correct") for r in rows)
    targets = sorted({r["target"] for r in rows})
    by_target = {t: [r for r in rows if r["target"] == t] for t in targets}
    by_seed: dict[Any, list[bool]] = {}
    for row in rows:
        by_seed.setdefault(row.get("seed"), []).append(succeeded(row))
    times = [r["sim_time_s"] for r in rows if r.get("sim_time_s") is not None]
    walls = [r["wall_time_s"] for r in rows if r.get("wall_time_s") is not None]
    causes = Counter(r["cause"] or "unknown" for r in rows if not succeeded(r))
    return {
        "success": wilson(sum(map(succeeded, rows)), n),
        "success_over_worlds": bootstrap_mean([float(np.mean(v)) for v in by_seed.values()]),
        "wrong_object": wilson(wrong, n),
        "other_ever_lifted": wilson(sum(bool(r.get("others_lifted")) for r in rows), n),
        "safety_stops": wilson(sum(r.get("exit_code") == 3 for r in rows), n),
        "tracebacks": wilson(sum(r.get("status") == "traceback" for r in rows), n),
        "lost": sum(r.get("status") == "lost" for r in rows),
        "by_target": {t: wilson(sum(map(succeeded, group)), len(group)) for t, group in by_target.items()},
        "causes": dict(causes.most_common()),
        "wall_s": bootstrap_mean(walls),
        "sim_s": bootstrap_mean(times),
        "median_sim_s": float(np.median(times)) if times else math.nan,
        "median_wall_s": float(np.median(walls)) if walls else math.nan,
        "peak_force_N": bootstrap_mean([r["peak_force_N"] for r in rows if r.get("peak_force_N") is not None]),
        "skill_time_s": _mean_by_skill([r["skill_time_s"] for r in rows if r.get("skill_time_s")]),
        "largest_peak_force_N": max((float(r.get("peak_force_N") or 0.0) for r in rows), default=0.0),
        "max_samples_over_limit": max((int(r.get("true_samples_over_limit") or 0) for r in rows), default=0),
        "peak_by_softness": peak_by_softness(rows),
    }


def peak_by_softness(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, float]]:
    """Return the true peaks of the harder and of the softer half of the worlds; one group if all are alike."""
    known = [r for r in rows if r.get("contact_softness_s") is not None and r.get("peak_force_N") is not None]
    ordered = sorted(known, key=lambda r: r["contact_softness_s"])
    alike = len({r["contact_softness_s"] for r in ordered}) < 2
    half = len(ordered) if alike else len(ordered) // 2
    groups = []
    for group in filter(None, (ordered[:half], ordered[half:])):
        peaks = [r["peak_force_N"] for r in group]
        middle, high = np.quantile(peaks, (0.5, 0.9)).tolist()
        groups.append({
            "from_s": group[0]["contact_softness_s"], "to_s": group[-1]["contact_softness_s"], "n": len(group),
            "median_N": middle, "p90_N": high, "largest_N": max(peaks),
        })  # fmt: skip
    return groups


def _mean_by_skill(trials: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the mean robot time of each skill in a trial, s, the longest first; a skill that did not run took none."""
    total: Counter[str] = Counter()
    for times in trials:
        total.update(times)
    return {skill: round(time_s / len(trials), 3) for skill, time_s in total.most_common()}
