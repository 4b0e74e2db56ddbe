"""One trial: make an input and try it, while everything that it must not do is watched."""

from __future__ import annotations

import os
import shutil
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from glotouch_bt.lazy import load_all
from glotouch_bt.validation.fuzz.kind import Class, FuzzKind
from glotouch_bt.validation.fuzz.watch import TooLong, Watch

MAX_DURATION_S = 30.0
"""Longest wall time of a trial."""


@dataclass(frozen=True)
class Result:
    """Result of one trial.

    Attributes:
        number: Number of the trial.
        sort: Sort of its input.
        came: Class of the result.
        detail: Error, traceback or forbidden action, for the bad classes.
    """

    number: int
    sort: str
    came: Class
    detail: str = ""


def stream_of(seed: int, number: int) -> np.random.Generator:
    """Return the random stream of a trial; trial n does not depend on the others."""
    return np.random.default_rng([seed, number])


def run_inputs(kind: FuzzKind, seed: int, numbers: Sequence[int]) -> list[Result]:
    """Try some inputs in turn in this process."""
    with _folder(kind) as folder:
        return [run_trial(kind, seed, n, folder) for n in numbers]


@contextmanager
def _folder(kind: FuzzKind) -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="glotouch-fuzz-"))
    here = Path.cwd()
    try:
        load_all()  # a module that is loaded later may write a cache
        kind.prepare(folder)
        os.chdir(folder)
        yield folder
    finally:
        os.chdir(here)
        shutil.rmtree(folder, ignore_errors=True)


@lru_cache(maxsize=1)
def _watch() -> Watch:
    return Watch()


def run_trial(kind: FuzzKind, seed: int, number: int, folder: Path) -> Result:
    """Run one trial; nothing in the input makes it raise."""
    rng = stream_of(seed, number)
    sort = kind.make(rng, folder)
    watch = _watch()
    came: Class
    try:
        with watch.on(folder, MAX_DURATION_S, writes=kind.writes):
            came, detail = kind.attempt(sort, folder, rng)
    except TooLong:
        came, detail = "hang", f"not done after {MAX_DURATION_S:g} s\n{traceback.format_exc()}"
    except (Exception, SystemExit, KeyboardInterrupt, MemoryError):
        came, detail = "traceback", traceback.format_exc()
    if watch.seen:
        came, detail = "code run", "\n".join(watch.seen)
    return Result(number, sort, came, detail)
