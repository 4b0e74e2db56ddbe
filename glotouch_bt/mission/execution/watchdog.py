"""A skill that blocks the process cannot be ticked out: a thread notices, holds the arm, and breaks it off."""

from __future__ import annotations

import ctypes
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from glotouch_bt.robot import GlotouchError, Robot

HOLD_AFTER_S = 0.25
"""A paced robot that was told to move and gets no further command is held after this wall time. Source: ours, 25
periods; drivers hold by themselves, this is for those that do not."""
STUCK_S = 120.0
"""Longest wall time of one tick, with what it waits for in its cycle. Source: ours; the longest ticks of the shipped
skills build a target's model, 20 s on a busy machine."""
GRACE_S = 10.0
"""What cannot be broken off within this time more, never will."""


class SkillHung(GlotouchError):
    """A tick did not come back.

    Args:
        node: Path of the node that was running.
        seconds: Wall time waited.
        stack: Of the stuck thread, as `traceback` formats it.
    """

    def __init__(self, node: str, seconds: float, stack: str) -> None:
        last = [line.strip() for line in stack.splitlines() if line.strip().startswith("File")]
        super().__init__(f"{node} has not come back for {seconds:.1f} s; it was at {last[-1] if last else '?'}")
        self.node, self.seconds, self.stack = node, seconds, stack


class BrokenOff(BaseException):
    """Raised inside the stuck thread; no `except Exception` of a skill catches it."""


@dataclass
class Stuck:
    """What the watchdog saw: the node, the wall time it waited, and the stack of the thread."""

    node: str
    seconds: float
    stack: str

    def error(self) -> SkillHung:
        """As an error."""
        return SkillHung(self.node, self.seconds, self.stack)


class Watchdog:
    """Watches the thread that made it. Use as a context manager round the tick loop; call `beat` once a cycle.

    Args:
        robot: Held when it is paced and no command comes.
        node: Path of the running node.
        stuck_s: Longest wall time between two beats; see `STUCK_S`.
        on_lost: Called from the watching thread with what was seen, if the stuck one cannot be broken off; it is
            expected to end the process.
        grace_s: See `GRACE_S`.

    Attributes:
        stuck: What was seen, once it was.
    """

    def __init__(
        self,
        robot: Robot,
        node: Callable[[], str],
        stuck_s: float,
        on_lost: Callable[[Stuck], None] | None = None,
        *,
        grace_s: float = GRACE_S,
    ) -> None:
        self._robot, self._node, self._stuck_s, self._on_lost = robot, node, stuck_s, on_lost
        self._grace_s = grace_s
        self._watched = threading.get_ident()
        self._main = threading.current_thread() is threading.main_thread()
        self._beat_s = time.monotonic()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self.stuck: Stuck | None = None

    @property
    def breaking_off(self) -> bool:
        """It has seen a stuck tick, and watches still."""
        return self.stuck is not None and not self._over.is_set()

    def beat(self) -> None:
        """The watched thread is alive."""
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
        look_every_s = min(0.25 * self._stuck_s, 0.5 * HOLD_AFTER_S if paced else 0.5)
        held_for = told = 0.0
        while not self._over.wait(look_every_s):
            beat_s = self._beat_s
            silent_s = time.monotonic() - beat_s
            if paced and silent_s > HOLD_AFTER_S and held_for != beat_s:
                held_for = beat_s
                self._robot.hold()
            if silent_s <= self._stuck_s:
                continue
            if self.stuck is None:
                self.stuck = Stuck(self._node(), silent_s, self._stack())
            if time.monotonic() - told > 0.5 * self._stuck_s:
                told = time.monotonic()
                self._break_off()
            if silent_s > self._stuck_s + self._grace_s and self._on_lost is not None:
                self._on_lost(self.stuck)

    def _stack(self) -> str:
        frame = sys._current_frames().get(self._watched)
        return "".join(traceback.format_stack(frame)) if frame is not None else ""

    def _break_off(self) -> None:
        """Make the watched thread raise `BrokenOff` (the main thread by its handler, which also ends a sleep)."""
        if self._main:
            signal.pthread_kill(self._watched, signal.SIGINT)
        else:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._watched), ctypes.py_object(BrokenOff))


class Interrupts:
    """Whether Ctrl-C was pressed.

    Attributes:
        pressed: It was.
        raising: A second one raises at once. False while nothing may be left half done.
    """

    def __init__(self, raising: bool = True) -> None:
        self.pressed, self.raising = False, raising

    def __call__(self) -> bool:
        """It was pressed."""
        return self.pressed


@contextmanager
def deferred_interrupt(watchdog: Watchdog | None = None, *, raising: bool = True) -> Iterator[Interrupts]:
    """Ctrl-C sets a flag, so that it takes effect between two cycles; a second Ctrl-C raises at once (`raising`).

    The same signal is what a watchdog breaks a stuck tick off with.
    """
    interrupts = Interrupts(raising)
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return

    def handler(number: int, frame: object) -> None:
        if watchdog is not None and watchdog.breaking_off:
            raise BrokenOff
        if interrupts.pressed and interrupts.raising:
            raise KeyboardInterrupt
        interrupts.pressed = True

    before = signal.signal(signal.SIGINT, handler)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, before)
