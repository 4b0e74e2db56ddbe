"""`bench pause`: pause missions again and again, and compare with unpaused twins of the same seed.

A mission paused at every n-th tick, wherever it is (in a motion, at a contact, with an object in the jaws), must end
like its twin and keep the hard limit. The sensor noise differs, because time passes during a pause.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.bench import wilson
from glotouch_bt.campaign import Campaign, OnRow, launch_trial, silent, write_summary, write_table
from glotouch_bt.mission.execution import Control
from glotouch_bt.report import read_run
from glotouch_bt.robot import Limits

COLUMNS = (
    "seed", "target", "status", "retrieved", "twin_status", "twin_retrieved", "same", "pauses", "on_the_way",
    "backed_off", "paused_s", "longest_to_rest_s", "peak_force_N", "twin_peak_force_N", "guards", "cause", "wall_s",
)  # fmt: skip


class EveryNthTick(Control):
    """Requests a pause at every n-th tick, each for a fixed robot time.

    Args:
        every: Ticks from one pause to the next.
        pause_s: Duration of each pause.

    Attributes:
        pauses: Number of pauses so far.
    """

    def __init__(self, every: int, pause_s: float) -> None:
        super().__init__()
        self._every, self._pause_s = every, pause_s
        self._next = every
        self._until_s = -1.0
        self.pauses = 0

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        """Return True while a pause is requested; ticks during a pause do not count."""
        if now_s < self._until_s:
            return True
        if self._until_s >= 0.0:
            self._until_s, self._next = -1.0, ticks + self._every
        if ticks >= self._next:
            self._until_s = now_s + self._pause_s
            self.pauses += 1
            return True
        return False


@dataclass(frozen=True, kw_only=True)
class PauseStudy(Campaign):
    """Settings: a paused mission and its twin for each seed; `every` and `pause_s` as in `EveryNthTick`."""

    every: int
    pause_s: float


def run_pauses(study: PauseStudy, on_row: OnRow = silent) -> dict[str, Any]:
    """Run every seed twice, write trials.csv and summary.json, and return the summary."""
    rows: list[dict[str, Any]] = []
    for seed in study.seeds:
        rows.append(_pair(study, seed))
        on_row(rows[-1], len(rows), len(study.seeds))
    write_table(study.out, "trials.csv", COLUMNS, rows)
    limit = Limits().hard_force_N
    summary = {
        "same": wilson(sum(bool(r["same"]) for r in rows), len(rows)),
        "pauses": sum(r["pauses"] for r in rows),
        "hard_limit_broken": sum(r["peak_force_N"] > limit for r in rows),
        "largest_peak_force_N": max(r["peak_force_N"] for r in rows),
        "longest_to_rest_s": max(r["longest_to_rest_s"] for r in rows),
        "trials": rows,
        "every": study.every,
        "pause_s": study.pause_s,
        **study.described(),
    }
    return write_summary(study.out, summary)


def _pair(study: PauseStudy, seed: int) -> dict[str, Any]:
    twin = launch_trial(study.request(seed, f"twin-s{seed}", report=False)).result
    control = EveryNthTick(study.every, study.pause_s)
    done = launch_trial(study.request(seed, f"paused-s{seed}", report=False), control=control)
    result = done.result
    places, longest_s = _rests(done.folder)
    return {
        "seed": seed,
        "target": result["target"],
        "status": result["status"],
        "retrieved": result["retrieved"],
        "twin_status": twin["status"],
        "twin_retrieved": twin["retrieved"],
        "same": (result["status"], result["retrieved"]) == (twin["status"], twin["retrieved"]),
        "pauses": control.pauses,
        "on_the_way": places.count("on the way"),
        "backed_off": places.count("backed off"),
        "paused_s": result["paused_s"],
        "longest_to_rest_s": longest_s,
        "peak_force_N": result["peak_force_N"],
        "twin_peak_force_N": twin["peak_force_N"],
        "guards": json.dumps(result["guards"]),
        "cause": (result["reasons"] or [""])[-1],
        "wall_s": result["wall_time_s"],
    }


def _rests(folder: Path) -> tuple[list[str], float]:
    """Return the node of each pause, and the longest time from request to standstill, s."""
    record = read_run(folder)
    places: list[str] = []
    longest_s, asked_s = 0.0, 0.0
    for event in record.events:
        if event.kind == "pause":
            asked_s = event.stamp_s
        elif event.kind == "paused":
            places.append(str(event.data["where"]))
            longest_s = max(longest_s, event.stamp_s - asked_s)
    return places, round(longest_s, 6)
