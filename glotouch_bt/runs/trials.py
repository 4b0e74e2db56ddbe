"""Campaigns of many runs: their settings, the results of worker processes, and the files they write."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from glotouch_bt.json_text import json_text
from glotouch_bt.runs.folder import RunFolder
from glotouch_bt.runs.request import RunRequest

T = TypeVar("T")
OnRow = Callable[[Any, int, int], object]
"""Called with (row, trials done, trials in all) after each trial."""


def silent(row: Any, done: int, total: int) -> None:
    """Show nothing."""


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Settings of a campaign of missions.

    Attributes:
        mission: Path or shipped name.
        seeds: Seeds of the trials.
        out: Folder of the campaign; it receives a run folder for each trial.
        settings: `--set` values of every trial.
        conditions: Path or shipped name.
        objects: Folder of STL files instead of the world's.
        backend: Registered name.
        resume: Keep the trials that are finished in `out`.
    """

    mission: str
    seeds: Sequence[int]
    out: Path
    settings: Mapping[str, str] = field(default_factory=dict)
    conditions: str = "nominal"
    objects: Path | None = None
    backend: str = "mujoco"
    resume: bool = False

    def request(self, seed: int, name: str, **changes: Any) -> RunRequest:
        """Return the request of a trial in the folder `name`; `changes` are further fields of the request."""
        given = {"settings": self.settings, "objects": self.objects, "out": self.out / name}
        return RunRequest(self.mission, self.backend, seed, conditions=self.conditions, **given | changes)

    def described(self) -> dict[str, Any]:
        """Return the settings that every summary.json repeats."""
        return {"mission": self.mission, "conditions": self.conditions, "seeds": list(self.seeds)}


def gather(futures: Sequence[Future[T]], on_result: OnRow = silent) -> list[T]:
    """Return the results of all futures in the order of completion; cancel the rest if one raises.

    Args:
        futures: Submitted to any `concurrent.futures` executor.
        on_result: Called with (result, results so far, futures) after each.
    """
    results: list[T] = []
    try:
        for future in as_completed(futures):
            results.append(future.result())
            on_result(results[-1], len(results), len(futures))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return results


def crashed(error: Exception) -> dict[str, Any]:
    """Return the columns of a trial that raised."""
    return {"status": "traceback", "exit_code": -1, "cause": f"traceback {type(error).__name__}: {error}"}


def write_table(folder: Path, name: str, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a CSV file atomically; further keys of the rows are left out."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, columns, extrasaction="ignore")
    table.writeheader()
    table.writerows(rows)
    RunFolder(folder).write_text(name, text.getvalue())


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json atomically, with null for numbers that are not finite."""
    RunFolder(folder).write_text("summary.json", json_text(summary))
