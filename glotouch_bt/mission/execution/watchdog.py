"""A watchdog thread that holds the arm and interrupts a skill whose tick does not return."""

from __future__ import annotations

import ctypes
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from glotouch_bt.robot import GlotouchError, Robot

HOLD_AFTER_S = 0.25
"""Hold a paced robot that gets no command for this wall time: 25 periods. For drivers that do not hold by themselves.
Source: ours."""
STUCK_S = 120.0
"""Longest wall time of one tick and its cycle. Source: ours; the longest ticks of the shipped skills build a target's
model, 20 s on a busy machine."""
GRACE_S = 10.0
"""Additional wall time in which an interrupted tick must return before the process is given up."""


class SkillHung(GlotouchError):
    """A tick did not return.

    Args:
        node: Path of the node that was running.
        seconds: Wall time waited.
        stack: Stack of the stuck thread, as `traceback` formats it.
    """

    def __init__(self, node: str, seconds: float, stack: str) -> None:
        last = [line.strip() for line in stack.splitlines() if line.strip().startswith("File")]
        super().__init__(f"{node} has not returned for {seconds:.1f} s; it was at {last[-1] if last else '?'}")
        self.node, self.seconds, self.stack = node, seconds, stack


class TickInterrupted(BaseException):
    """Raised inside the stuck thread. Not an `Exception`, so that no skill catches it by accident."""


class Watchdog:
    """Watch the thread that creates it. Use as a context manager around the tick loop; call `beat` once a cycle.

    Args:
        robot: Robot to hold if it is paced and gets no command.
        node: Returns the path of the running node.
        stuck_s: Longest wall time between two beats; see `STUCK_S`.
        on_unresponsive: Called from the watchdog thread if the stuck tick cannot be interrupted; it should end the
            process.
        grace_s: See `GRACE_S`.

    Attributes:
        stuck: The stuck tick as an error, once seen.
    """

    def __init__(
        self,
        robot: Robot,
        node: Callable[[], str],
        stuck_s: float,
        on_unresponsive: Callable[[SkillHung], None] | None = None,
        *,
        grace_s: float = GRACE_S,
    ) -> None:
        self._robot, self._node, self._stuck_s, self._on_lost = robot, node, stuck_s, on_unresponsive
        self._grace_s = grace_s
        self._watched = threading.get_ident()
        self._main = threading.current_thread() is threading.main_thread()
        self._beat_s = time.monotonic()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self.stuck: SkillHung | None = None

    @property
    def interrupting(self) -> bool:
        """True after a stuck tick was seen and until the watch ends."""
        return self.stuck is not None and not self._over.is_set()

    def beat(self) -> None:
        """Report that the watched thread is alive."""
        self._beat_s = time.monotonic()

    def __enter__(self) -> Self:
        self.beat()
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, trace: TracebackType | None) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        paced = getattr(self._robot, "paced", False)
        interval_s = min(0.25 * self._stuck_s, 0.5 * HOLD_AFTER_S if paced else 0.5)
        held_beat_s = interrupted_s = 0.0
        while not self._over.wait(interval_s):
            beat_s = self._beat_s
            silent_s = time.monotonic() - beat_s
            if paced and silent_s > HOLD_AFTER_S and held_beat_s != beat_s:
                held_beat_s = beat_s
                self._robot.hold()
            if silent_s <= self._stuck_s:
                continue
            if self.stuck is None:
                self.stuck = SkillHung(self._node(), silent_s, self._stack())
            if time.monotonic() - interrupted_s > 0.5 * self._stuck_s:
                interrupted_s = time.monotonic()
                self._interrupt()
            if silent_s > self._stuck_s + self._grace_s and self._on_lost is not None:
                self._on_lost(self.stuck)

    def _stack(self) -> str:
        frame = sys._current_frames().get(self._watched)
        return "".join(traceback.format_stack(frame)) if frame is not None else ""

    def _interrupt(self) -> None:
        """Make the watched thread raise `TickInterrupted`; a signal to the main thread also ends a sleep."""
        if self._main:
            signal.pthread_kill(self._watched, signal.SIGINT)
        else:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._watched), ctypes.py_object(TickInterrupted))


class Interrupts:
    """State of Ctrl-C; calling it returns `pressed`.

    Attributes:
        pressed: Ctrl-C was pressed.
        raising: A second Ctrl-C raises at once. False while clean-up must complete.
    """

    def __init__(self, raising: bool = True) -> None:
        self.pressed, self.raising = False, raising

    def __call__(self) -> bool:
        """Return True if Ctrl-C was pressed."""
        return self.pressed


@contextmanager
def deferred_interrupt(watchdog: Watchdog | None = None, *, raising: bool = True) -> Iterator[Interrupts]:
    """Defer Ctrl-C to the end of the control cycle; a second Ctrl-C raises at once if `raising`.

    The watchdog uses the same signal to interrupt a stuck tick.
    """
    interrupts = Interrupts(raising)
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return

    def handler(number: int, frame: object) -> None:
        if watchdog is not None and watchdog.interrupting:
            raise TickInterrupted
        if interrupts.pressed and interrupts.raising:
            raise KeyboardInterrupt
        interrupts.pressed = True

    before = signal.signal(signal.SIGINT, handler)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, before)
