"""A campaign of short trials, some of which die, hang or fail, for tests of the campaign engine."""

from __future__ import annotations

import errno
import hashlib
import math
import os
import signal
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import Campaign, OnRow, Row, Shard, Trial, crashed, run_trials, silent, write_table

COLUMNS = ("number", "digest", "value", "status", "cause")
Kind = str
"""Behaviour of a trial: "" works; "raise", "kill", "hang", "full" fail; "kill once", "full once" recover."""


def short_campaign(out: Path, *, resume: bool = False, shard: Shard | None = None, **changes: Any) -> Campaign:
    """Return the settings of a campaign of short trials."""
    return Campaign(mission="short", seeds=(), out=out, backend="fake", resume=resume, shard=shard, **changes)


def short_trials(campaign: Campaign, count: int, rounds: int, kinds: dict[int, Kind] | None = None) -> list[Trial]:
    """Return trials that hash a text `rounds` times; `kinds` says which of them fail."""
    given = [(n, rounds, (kinds or {}).get(n, ""), campaign.out) for n in range(count)]
    return [campaign.trial(f"t{g[0]:04d}", partial(work, *g), partial(failed, g[0]), given=g[:2]) for g in given]


def work(number: int, rounds: int, kind: Kind, out: Path) -> Row:
    """Do one trial."""
    note(out, f"begin {number}")
    kind, once = kind.removesuffix(" once"), kind.endswith(" once")
    marker = out / f"{number}.again"
    if not (once and marker.exists()):
        if once:
            marker.touch()
        act(kind)
    found = str(number).encode()
    for _ in range(rounds):
        found = hashlib.sha256(found).digest()
    note(out, f"end {number}")
    value = (math.nan, -math.inf, number / 3)[number % 3]
    return {"number": number, "digest": found.hex(), "value": value, "status": "done", "cause": ""}


def act(kind: Kind) -> None:
    """Fail as the kind says."""
    if kind == "raise":
        raise KeyError("a bug")
    if kind == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "hang":
        threading.Event().wait()
    if kind == "full":
        raise RuntimeError("no file") from OSError(errno.ENOSPC, "No space left on device")


def failed(number: int, error: Exception) -> Row:
    """Return the row of a failed trial."""
    return {"number": number, **crashed(error)}


def note(out: Path, line: str) -> None:
    """Add a line to the journal of the campaign, whole beside those of other processes."""
    handle = os.open(out / "journal", os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    os.write(handle, f"{line} {os.getpid()}\n".encode())
    os.close(handle)


def run_short(
    campaign: Campaign, executor: Executor, trials: Sequence[Trial], on_row: OnRow = silent, **given: Any
) -> list[Row]:
    """Run trials and write trials.csv."""
    write = partial(write_table, campaign.out, "trials.csv", COLUMNS)
    return run_trials(executor, trials, campaign, on_row, write=write, **given)
