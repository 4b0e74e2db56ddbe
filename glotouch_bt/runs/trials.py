"""Campaigns of many runs: their settings, their trials in worker processes, and the files they write."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from glotouch_bt.escaped_text import json_text
from glotouch_bt.robot import BadInput
from glotouch_bt.runs.folder import RunFolder
from glotouch_bt.runs.launch import launch
from glotouch_bt.runs.request import RunRequest, RunResult
from glotouch_bt.runs.trial_memory import TrialMemory
from glotouch_bt.runs.workers import WorkerLost

T = TypeVar("T")
Row = dict[str, Any]
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
        world: Path or shipped name of a world instead of the mission's.
        backend: Registered name.
        resume: Keep the trials that are finished in `out`.
    """

    mission: str
    seeds: Sequence[int]
    out: Path
    settings: Mapping[str, str] = field(default_factory=dict)
    conditions: str = "nominal"
    objects: Path | None = None
    world: str | None = None
    backend: str = "mujoco"
    resume: bool = False

    def request(self, seed: int, name: str, **changes: Any) -> RunRequest:
        """Return the request of a trial in the folder `name`; `changes` are further fields of the request."""
        given: dict[str, Any] = {"settings": self.settings, "objects": self.objects, "world": self.world}
        given |= {"conditions": self.conditions, "out": self.out / name, "overwrite": True}
        return RunRequest(self.mission, self.backend, seed, **given | changes)

    def described(self) -> dict[str, Any]:
        """Return the settings that every summary.json repeats."""
        world = {} if self.world is None else {"world": self.world}
        return {"mission": self.mission, **world, "conditions": self.conditions, "seeds": list(self.seeds)}


@dataclass(frozen=True)
class Task(Generic[T]):
    """Work for a worker process whose failure is a result, not an exception.

    Attributes:
        run: Does the work; it can be pickled.
        failed: Returns the result that stands for an error of `run` or for a lost process (`WorkerLost`).
    """

    run: Callable[[], T]
    failed: Callable[[Exception], T]

    def __call__(self) -> T:
        """Do the work in this process.

        Raises:
            BadInput: The request itself is wrong, so that no trial can be run.
            KeyboardInterrupt: The work was interrupted.
        """
        try:
            return self.run()
        except BadInput:
            raise
        except Exception as e:
            return self.failed(e)


@dataclass(frozen=True)
class Trial(Task[Row]):
    """A run of a campaign and its row, which the run's folder remembers together with the request.

    Attributes:
        memory: The trial's folder and request.
    """

    memory: TrialMemory

    def __call__(self) -> Row:
        """See `Task`. A trial that was interrupted or whose process was lost is not remembered."""
        self.memory.forget()
        row = super().__call__()
        self.memory.write(row)
        return row


def gather(executor: Executor, tasks: Sequence[Task[T]], on_result: OnRow = silent) -> list[T]:
    """Run tasks on any executor; return their results in the order of completion. If one raises, cancel the rest.

    Args:
        executor: A `WorkerPool` in commands.
        tasks: The tasks.
        on_result: Called with (result, results so far, tasks) after each.
    """
    futures = {executor.submit(task): task for task in tasks}
    results: list[T] = []
    try:
        for future in as_completed(futures):
            try:
                result = future.result()
            except WorkerLost as e:
                result = futures[future].failed(e)
            results.append(result)
            on_result(result, len(results), len(futures))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return results


def run_trials(executor: Executor, trials: Sequence[Trial], resume: bool, on_row: OnRow = silent) -> list[Row]:
    """Run trials; return their rows. With `resume`, finished trials with the same request are not run again.

    Raises:
        BadInput: A finished trial was made with another request; nothing was run.
    """
    kept = [t.memory.read() if resume else None for t in trials]
    rows = [row for row in kept if row is not None]
    for n, row in enumerate(rows):
        on_row(row, n + 1, len(trials))
    left = [trial for trial, row in zip(trials, kept, strict=True) if row is None]
    return rows + gather(executor, left, lambda row, n, _: on_row(row, len(rows) + n, len(trials)))


def launch_trial(request: RunRequest, **given: Any) -> RunResult:
    """Launch a run of a campaign; arguments as for `launch`.

    Raises:
        KeyboardInterrupt: The run was interrupted: it is no trial.
        BadInput, BackendError: As `launch`.
    """
    done = launch(request, **given)
    if isinstance(done.outcome.error, KeyboardInterrupt):
        raise done.outcome.error
    return done


def crashed(error: Exception) -> dict[str, Any]:
    """Return the columns of a trial that raised or whose process was lost."""
    if isinstance(error, WorkerLost):
        return {"status": "lost", "exit_code": -1, "cause": f"lost: {error}"}
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
