"""Time as the driver sees it: of the wall, or of a simulated world that moves only when it is told to.

Whoever waits, waits on the clock. So a vendor call that blocks looks the same in both, and a run on simulated devices
is as fast as the machine allows and the same every time.
"""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol


class Clock(Protocol):
    """Seconds since the devices were opened."""

    def now_s(self) -> float:
        """Present time."""
        ...

    def sleep_until(self, stamp_s: float) -> None:
        """Return when `now_s` has reached `stamp_s`; at once if it has."""
        ...

    def spawn(self, work: Callable[[], None]) -> None:
        """Run `work`, which must not raise, beside the caller."""
        ...


class WallClock:
    """The monotonic clock of this machine.

    Args:
        zero_s: Reading of `time.monotonic` that counts as 0 (default: now).
    """

    def __init__(self, zero_s: float | None = None) -> None:
        self._zero = time.monotonic() if zero_s is None else zero_s

    def now_s(self) -> float:
        """See `Clock`."""
        return time.monotonic() - self._zero

    def sleep_until(self, stamp_s: float) -> None:
        """See `Clock`."""
        left = stamp_s - self.now_s()
        if left > 0.0:
            time.sleep(left)

    def spawn(self, work: Callable[[], None]) -> None:
        """See `Clock`: a daemon thread."""
        threading.Thread(target=work, daemon=True).start()


class SteppedClock:
    """A clock that a world of our own makes: time passes while somebody sleeps, and at no other moment.

    With nobody conducting, whoever sleeps advances the world. With a conductor (the driver's loop), its sleeps advance
    the world; a worker started by `spawn` runs only while the conductor has handed over to it: from its start or the
    end of its sleep to its next sleep or its end. One thread runs at a time, in an order that never depends on the
    machine's load, so the world needs no locks and the run is the same every time. Any other thread that sleeps waits
    for the time to come and is not ordered.

    Args:
        advance: Moves the world forward to a time.
        now_s: Where it stands.
    """

    def __init__(self, advance: Callable[[float], None], now_s: float = 0.0) -> None:
        self._advance, self._now = advance, now_s
        self._turn = threading.Condition()
        self._conductor: int | None = None
        self._running: int | None = None  # the worker that has been handed over to
        self._workers: set[int] = set()
        self._sleepers: list[tuple[float, int, int]] = []  # wake time, order of going to sleep, thread
        self._order = 0

    def now_s(self) -> float:
        """See `Clock`."""
        return self._now

    @contextmanager
    def conducting(self) -> Iterator[None]:
        """From now on the calling thread's sleeps, and only they, advance the world."""
        self._conductor = threading.get_ident()
        try:
            yield
        finally:
            self._conductor = None

    def spawn(self, work: Callable[[], None]) -> None:
        """See `Clock`. Comes back when the work sleeps for the first time, or is done."""
        conductor = self._conductor
        if conductor is None or threading.get_ident() != conductor:
            work()
            return
        started = threading.Event()

        def run() -> None:
            me = threading.get_ident()
            with self._turn:
                self._workers.add(me)
                self._running = me
            started.set()
            try:
                work()
            finally:
                with self._turn:
                    self._workers.discard(me)
                    self._running = None
                    self._turn.notify_all()

        threading.Thread(target=run, daemon=True).start()
        started.wait()
        self._wait_for_my_turn()

    def sleep_until(self, stamp_s: float) -> None:
        """See `Clock`."""
        me = threading.get_ident()
        if me in self._workers:
            with self._turn:
                self._order += 1
                heapq.heappush(self._sleepers, (stamp_s, self._order, me))
                self._running = None
                self._turn.notify_all()
                self._turn.wait_for(lambda: self._running == me)
        elif self._conductor is None or me == self._conductor:
            while self._sleepers and self._sleepers[0][0] <= stamp_s:
                self._move_to(self._sleepers[0][0])
                _, _, worker = heapq.heappop(self._sleepers)
                with self._turn:
                    self._running = worker
                    self._turn.notify_all()
                self._wait_for_my_turn()
            self._move_to(stamp_s)
        else:
            with self._turn:
                self._turn.wait_for(lambda: self._now >= stamp_s - 1e-9)

    def _wait_for_my_turn(self) -> None:
        with self._turn:
            self._turn.wait_for(lambda: self._running is None)

    def _move_to(self, stamp_s: float) -> None:
        if stamp_s > self._now:
            self._advance(stamp_s)
            with self._turn:
                self._now = stamp_s
                self._turn.notify_all()
