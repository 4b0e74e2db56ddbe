"""Pause, resume and stop requests for a running mission, from any thread or from a signal handler."""

from __future__ import annotations

import threading
from collections.abc import Iterable

from glotouch_bt.robot import GlotouchError

STAMP_ROUNDING_S = 5e-4
"""Tolerance for pause stamps read back from a record, s."""


class Preempted(GlotouchError):
    """A stop was requested; the message says why."""


class Control:
    """Operator requests to a running mission. Pass one to `run_mission` and call it from elsewhere.

    The running skill declares how it pauses (`Skill.PAUSE`); the record says when the arm stood. A stop aborts the
    mission: the arm stops, rises if it is free, and holds.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()  # reentrant: a signal handler may interrupt a holder
        self._paused = False
        self._stop: str | None = None

    @property
    def paused(self) -> bool:
        """True while a pause is requested."""
        return self._paused

    @property
    def stopped(self) -> str | None:
        """Reason of the requested stop, or None."""
        return self._stop

    def pause(self) -> None:
        """Request a pause; it takes effect as soon as the running skill allows."""
        with self._lock:
            self._paused = True

    def resume(self) -> None:
        """Withdraw the pause request; the mission continues where it paused."""
        with self._lock:
            self._paused = False

    def toggle(self) -> None:
        """Pause or resume."""
        with self._lock:
            self._paused = not self._paused

    def stop(self, why: str = "asked to stop") -> None:
        """Request a safe stop, also of a paused mission. The first reason given is kept."""
        with self._lock:
            self._stop = self._stop or why

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        """Return True to pause; the runner asks once a period, with its tick count and the robot clock."""
        return self._paused

    def rest(self, period_s: float) -> None:
        """Hook called once a period while a simulated robot is paused, to pace its clock. Does nothing here."""


class TimedPauses(Control):
    """Pauses at given times, for example those of a recorded run.

    Args:
        spans_s: (start, end) of each pause on the robot clock: the stamps of its `pause` and `resumed` events.
    """

    def __init__(self, spans_s: Iterable[tuple[float, float]]) -> None:
        super().__init__()
        self._spans_s = sorted(spans_s)

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        """Return True within a span, allowing for rounded stamps."""
        at_s = now_s + STAMP_ROUNDING_S
        return any(begin <= at_s < end for begin, end in self._spans_s)
