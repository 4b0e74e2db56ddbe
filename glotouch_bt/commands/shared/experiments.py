"""Shared by the experiments: worker processes, progress lines, summaries, a box with few objects."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from glotouch_bt.commands.shared.options import check_parameters
from glotouch_bt.commands.shared.output import print_json

if TYPE_CHECKING:
    from concurrent.futures import Executor

T = TypeVar("T")
Show = Callable[[Any, int, int], None]


def progress(told: Callable[[Any], str]) -> Show:
    """Return a function that prints the line of a row on stderr, after its number."""
    return lambda row, done, total: print(f"[{done}/{total}] {told(row)}", file=sys.stderr)


def run_in_pool(
    run: Callable[[T, Executor, Show], dict[str, Any]], campaign: T, workers: int, told: Callable[[Any], str]
) -> dict[str, Any]:
    """Run a campaign in worker processes; return its summary."""
    from glotouch_bt.runs import WorkerPool

    with WorkerPool(workers) as pool:
        return run(campaign, pool, progress(told))


def print_summary(
    summary: dict[str, Any], folder: Path, print_tables: Callable[[dict[str, Any], Path], None], json_: bool
) -> None:
    """Print an experiment's summary as JSON or as tables."""
    if json_:
        print_json(summary)
    else:
        print_tables(summary, folder)


def put_few_in_box(
    mission: str, settings: dict[str, str], objects: Path | None, few: int, folder: Path
) -> tuple[Path, dict[str, str]]:
    """Copy the first `few` objects of a mission into a folder; return it and the settings that fit.

    Raises:
        BadInput: The mission has no parameters `target` and `expected_objects`, or cannot be run so.
    """
    from glotouch_bt.mission import load_mission
    from glotouch_bt.validation.faults import few_objects

    loaded = load_mission(mission, settings, objects=objects)
    check_parameters(loaded, ("target", "expected_objects"))
    box, names = few_objects(loaded.world.objects, few, folder)
    settings = {"target": names[0], "expected_objects": str(len(names))} | settings
    load_mission(mission, settings, objects=box)
    return box, settings
