"""Shared by the experiments: worker processes, progress lines, summaries, a box with few objects."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from glotouch_bt.commands.shared.options import TRIAL_LIMIT_S, check_parameters
from glotouch_bt.commands.shared.output import print_json

if TYPE_CHECKING:
    from concurrent.futures import Executor

C = TypeVar("C")
Show = Callable[[Any, int, int], None]


def progress(describe_row: Callable[[Any], str]) -> Show:
    """Return a function that prints the line of a row on stderr, after its number."""
    return lambda row, done, total: print(f"[{done}/{total}] {describe_row(row)}", file=sys.stderr)


@dataclass(frozen=True)
class Executors:
    """The processes that run the trials of a campaign.

    Attributes:
        workers: Number of processes on this machine.
        cluster: Address of a dask scheduler, or "local", instead.
        limit_s: Wall time after which a trial counts as hanging.
    """

    workers: int
    cluster: str | None = None
    limit_s: float = TRIAL_LIMIT_S

    def pool(self) -> Executor:
        """Start them."""
        from glotouch_bt.campaign import ClusterPool, WorkerPool

        if self.cluster is not None:
            return ClusterPool(self.cluster, self.workers, self.limit_s)
        return WorkerPool(self.workers, self.limit_s)


def run_in_pool(
    run: Callable[[C, Executor, Show], dict[str, Any]],
    campaign: C,
    executors: Executors,
    describe_row: Callable[[Any], str],
    succeeded: Callable[[Any], bool] | None = None,
) -> dict[str, Any]:
    """Run a campaign in worker processes; return its summary.

    Args:
        run: Runs the campaign on an executor.
        campaign: Its settings.
        executors: The processes.
        describe_row: Returns the line of a row.
        succeeded: Returns True for the row of a success.

    Raises:
        Exit: The trials of this shard are done; there is no summary before those of all shards are.
    """
    from glotouch_bt.campaign import ShardDone
    from glotouch_bt.commands.terminal import CampaignProgress

    try:
        with executors.pool() as pool, CampaignProgress(describe_row, succeeded) as progress:
            return run(campaign, pool, progress)
    except ShardDone as e:
        sys.stderr.write(f"{e}; when all are done, the same command with --resume instead of --shard sums them up\n")
        raise typer.Exit(0) from e


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
