"""The driver's time: wall time, or the time of a simulated world that advances only on request.

Every wait uses the clock. A blocking vendor call therefore works with both, and a run on simulated devices is as fast
as the machine allows and reproducible.
"""

from __future__ import annotations

import heapq
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Clock(ABC):
    """Seconds since the devices were opened."""

    @abstractmethod
    def now_s(self) -> float:
        """Return the present time."""

    @abstractmethod
    def sleep_until(self, stamp_s: float) -> None:
        """Block until `now_s` has reached `stamp_s`."""

    def spawn(self, work: Callable[[], None]) -> None:
        """Run `work`, which must not raise, concurrently with the caller."""
        threading.Thread(target=work, daemon=True).start()


class WallClock(Clock):
    """Monotonic clock of this machine.

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


class SteppedClock(Clock):
    """Clock of a simulated world: time passes only while a thread sleeps on it.

    Without a conductor, every sleeping thread advances the world. With a conductor (the driver's loop), only its sleeps
    advance the world, and a worker started by `spawn` runs only while the conductor waits for it: from its start or
    wake-up to its next sleep or its end. One thread runs at a time, in an order that does not depend on the machine's
    load, so the world needs no locks and every run is the same. Any other thread that sleeps waits for its time without
    an order.

    Args:
        advance: Advances the world to a time.
    """

    def __init__(self, advance: Callable[[float], None]) -> None:
        self._advance, self._now = advance, 0.0
        self._turn = threading.Condition()
        self._conductor: int | None = None
        self._running: int | None = None  # the worker that runs now
        self._workers: set[int] = set()
        self._sleepers: list[tuple[float, int, int]] = []  # wake-up time, order of going to sleep, thread
        self._order = 0

    def now_s(self) -> float:
        """See `Clock`."""
        return self._now

    @contextmanager
    def conducting(self) -> Iterator[None]:
        """Make the calling thread the conductor: only its sleeps advance the world."""
        self._conductor = threading.get_ident()
        try:
            yield
        finally:
            self._conductor = None

    def spawn(self, work: Callable[[], None]) -> None:
        """See `Clock`. Return when the work first sleeps, or ends."""
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
