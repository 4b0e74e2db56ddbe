"""`bench space`: push each object of a box once, or lift each one out. Is it where the map says, and does it stand?

A trial is one layout and one act: the mission finds and measures all objects, then pushes each once (`nudge_each`), or
lifts each out and sets it down elsewhere (`clear_each`). After each act the map is compared with the truth: the
candidate's centre with that of the object's true section at the height of the probe. The true world at that time is in
the run's checkpoints. What the probe toppled or moved before the act is counted apart.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.bench.retrieve import cause
from glotouch_bt.bench.search import sections_of
from glotouch_bt.bench.space.scoring import score
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
from glotouch_bt.report import read_run
from glotouch_bt.runs import RunRequest, past_worlds

ACTS = ("nudge", "clear")
"""Acts on each object; the mission is the name of the act with `_each`."""
WITHIN_MM = 5.0
"""Position error that an act may leave. Source: the goal of the project."""
COLUMNS = (
    "act", "seed", "candidate", "object", "tried", "done", "cause", "position_error_mm", "error_before_mm",
    "error_at_end_mm", "moved_mm", "tilt_deg", "toppled", "fallen_before", "peak_N", "duration_s", "exit_code",
    "status", "peak_force_N", "sim_time_s", "wall_time_s", "folder",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SpaceCampaign(Campaign):
    """Settings of the campaign; the act completes the mission's name.

    Attributes:
        acts: Names of `ACTS`.
    """

    mission: str = "each"
    acts: tuple[str, ...] = ACTS

    def trials(self) -> list[Trial]:
        """Return every trial, seeds outermost."""
        return [self._trial(act, seed) for seed in self.seeds for act in self.acts]

    def _trial(self, act: str, seed: int) -> Trial:
        name = f"{act}-s{seed}"
        request = replace(self.request(seed, name), mission=f"{act}_each")
        head = {"act": act, "seed": seed, "folder": name}
        return Trial.of(request, partial(run_trial, head, request), partial(_failed, head))


def run_trial(head: Row, request: RunRequest) -> Row:
    """Run one trial in this process and return its row, which begins with the columns `head`."""
    sections = sections_of(request.mission, request.objects, request.world)
    done = launch_trial(request)
    row = head | {k: done.result.get(k) for k in COLUMNS if k in done.result}
    row |= {"exit_code": done.exit_code, "cause": "" if done.exit_code == 0 else cause(done.result)}
    record = read_run(done.folder)
    with past_worlds(done.folder, request.objects, request.settings) as worlds:

        def objects_at(stamp_s: float) -> Any:
            return worlds.objects([r for r in worlds.rows if r.stamp_s <= stamp_s][-1])

        return row | {"objects": score(record, sections, head["act"], objects_at)}


def _failed(head: Row, error: Exception) -> Row:
    return head | crashed(error) | {"objects": []}


def run_campaign(campaign: SpaceCampaign, executor: Executor, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every trial on the executor, write trials.csv and summary.json, and return the summary."""
    rows = run_trials(executor, campaign.trials(), campaign, on_row, write=partial(_write, campaign.out))
    more = {"backend": campaign.backend, "settings": dict(campaign.settings), "within_mm": WITHIN_MM}
    summary = {act: summarise([r for r in rows if r["act"] == act]) for act in campaign.acts}
    return write_summary(campaign.out, summary | campaign.described() | more)


def _write(folder: Path, rows: Sequence[Row]) -> None:
    flat = [row | thing for row in rows for thing in row["objects"] or [{}]]
    write_table(
        folder, "trials.csv", COLUMNS, sorted(flat, key=lambda r: (r["act"], r["seed"], r.get("candidate", -1)))
    )


def summarise(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what became of the objects of all layouts of one act.

    Rates have Wilson intervals over the objects. `..._over_worlds` is the mean of the layouts' rates, with a bootstrap
    interval: objects of one layout are not independent. An object that was moved but whose candidate belongs to none
    counts as not within. Objects that had fallen before count only in `fallen_before`.
    """
    everything = [t for r in rows for t in r["objects"]]
    worlds = [[t for t in r["objects"] if not t.get("fallen_before")] for r in rows]
    things = [t for world in worlds for t in world]
    done = [t for t in things if t["done"]]
    tried = [t for t in things if t["tried"]]
    errors = [t["position_error_mm"] for t in done if t.get("position_error_mm") is not None]
    shares = [float(np.mean([within(t) for t in w if t["done"]])) for w in worlds if any(t["done"] for t in w)]
    return {
        "worlds": len(rows),
        "worlds_failed": dict(Counter(r["cause"] for r in rows if r["cause"]).most_common()),
        "fallen_before": sum(bool(t.get("fallen_before")) for t in everything),
        "asked": len(things),
        "done": wilson(len(done), len(things)),
        "done_of_tried": wilson(len(done), len(tried)),
        "not_done": dict(Counter(t["cause"] for t in things if not t["done"]).most_common()),
        "within": wilson(sum(map(within, done)), len(done)),
        "within_over_worlds": bootstrap_mean(shares),
        "off_before": sum(t.get("error_before_mm", 0.0) > WITHIN_MM for t in done if not within(t)),
        "within_at_end": wilson(sum(t.get("error_at_end_mm", np.inf) <= WITHIN_MM for t in done), len(done)),
        "position_error_mm": _quantiles(errors),
        "toppled": wilson(sum(bool(t.get("toppled")) for t in things), len(things)),
        "safety_stops": wilson(sum(r.get("exit_code") == 3 for r in rows), len(rows)),
        "peak_N": _quantiles([t["peak_N"] for t in things if t["tried"] and t.get("peak_N") is not None]),
        "largest_peak_force_N": max((float(r.get("peak_force_N") or 0.0) for r in rows), default=0.0),
        "duration_s": bootstrap_mean([t["duration_s"] for t in done]),
    }


def within(thing: Mapping[str, Any]) -> bool:
    """Return True if an object stands where the map says."""
    error = thing.get("position_error_mm")
    return error is not None and bool(error <= WITHIN_MM)


def _quantiles(values: Sequence[float]) -> dict[str, Any]:
    """Return median, 95 % quantile and maximum."""
    if not values:
        return {"median": None, "p95": None, "max": None, "n": 0}
    median, p95 = np.quantile(values, [0.5, 0.95])
    return {"median": float(median), "p95": float(p95), "max": float(max(values)), "n": len(values)}
