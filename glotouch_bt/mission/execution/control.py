"""What an operator wants of a running mission: pause, resume, stop. From any thread, or from a signal handler."""

from __future__ import annotations

import threading
from collections.abc import Iterable

from glotouch_bt.robot import GlotouchError

STAMP_ROUNDING_S = 5e-4


class Preempted(GlotouchError):
    """The mission was asked to stop; carries why, in a few words."""


class Control:
    """Hand one to `run_mission` and call it from elsewhere: a thread, a signal handler, a key.

    Pausing is asked for; the skill that runs declares what it does to it (`Skill.PAUSE`), and the record says when the
    arm stood. A stop ends the mission: the arm stops, rises if it is free, and is held.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()  # a signal handler may come in between
        self._paused = False
        self._stop: str | None = None

    @property
    def paused(self) -> bool:
        """A pause is asked for."""
        return self._paused

    @property
    def stopped(self) -> str | None:
        """Why a stop was asked for, or None."""
        return self._stop

    def pause(self) -> None:
        """Pause as soon as the running skill allows; nothing happens if it is asked for already."""
        with self._lock:
            self._paused = True

    def resume(self) -> None:
        """Go on where it was paused."""
        with self._lock:
            self._paused = False

    def toggle(self) -> None:
        """Pause, or go on."""
        with self._lock:
            self._paused = not self._paused

    def stop(self, why: str = "asked to stop") -> None:
        """End the mission safely; the first reason stands. A paused mission ends, too."""
        with self._lock:
            self._stop = self._stop or why

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        """Asked by the runner once a period, with its ticks so far and the robot's clock; scripts override it."""
        return self._paused

    def rest(self, period_s: float) -> None:
        """Called once a period in a pause of a robot whose clock is its own (a simulation's): nothing by default."""


class TimedPauses(Control):
    """Pauses that are known beforehand, as those of a recorded run.

    Args:
        spans_s: (asked for, going on) of each pause on the robot's clock: the stamps of `pause` and `resumed` events.
    """

    def __init__(self, spans_s: Iterable[tuple[float, float]]) -> None:
        super().__init__()
        self._spans_s = sorted(spans_s)

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        """True within a span; half a millisecond is left for rounded stamps."""
        at_s = now_s + STAMP_ROUNDING_S
        return any(begin <= at_s < end for begin, end in self._spans_s)
