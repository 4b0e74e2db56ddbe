"""Worker processes and summaries of the experiments."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glotouch_bt.commands.shared import print_json

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor


def worker_pool(workers: int) -> ProcessPoolExecutor:
    """Return a pool of fresh processes (spawned: MuJoCo and threads do not survive a fork)."""
    import concurrent.futures
    from multiprocessing import get_context

    return concurrent.futures.ProcessPoolExecutor(workers, mp_context=get_context("spawn"))


def print_summary(
    summary: dict[str, Any], folder: Path, print_tables: Callable[[dict[str, Any], Path], None], json_: bool
) -> None:
    """Print an experiment's summary as JSON or as tables."""
    if json_:
        print_json(summary)
    else:
        print_tables(summary, folder)
