"""One trial of a campaign of faults: its limit of wall time, durations of its nodes, removal of its record."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE
from glotouch_bt.report import read_run
from glotouch_bt.runs import EARLIER

HUNG_S = 900.0
"""Wall time after which a trial counts as hanging, s."""


class Hung(BaseException):
    """The trial exceeded its wall time."""


@contextmanager
def hang_guard(seconds: float = HUNG_S) -> Iterator[None]:
    """Raise `Hung` in the main thread after `seconds` of wall time."""

    def ring(number: int, frame: FrameType | None) -> None:
        raise Hung

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def durations(folder: Path) -> dict[str, float]:
    """Return the duration of each node's first run in s, by the node's name, from a run's record."""
    began: dict[str, float] = {}
    found: dict[str, float] = {}
    for tick in read_run(folder).ticks:
        name = tick.node.rsplit("/", 1)[-1]
        if tick.new == "RUNNING":
            began.setdefault(name, tick.stamp_s)
        elif name in began and name not in found:
            found[name] = tick.stamp_s - began[name]
    return found


def tidy(folder: Path, everything: bool) -> None:
    """Remove a trial's checkpoints and replaced files; with `everything`, remove its record too."""
    shutil.rmtree(folder / EARLIER, ignore_errors=True)
    for file in folder.glob(f"{CHECKPOINT_FILE}*"):
        file.unlink()
    if everything:
        for name in ("run.mcap", "truth.json", "mission.yaml"):
            (folder / name).unlink(missing_ok=True)
