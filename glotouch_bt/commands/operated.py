"""The operator of a running mission: signals and keys become calls of its `Control`.

SIGUSR1 pauses and goes on; SIGTERM ends the mission safely, a second one at once; `p` on a terminal is SIGUSR1.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from glotouch_bt.mission.control import Control

LOOK_EVERY_S = 0.1
LONGEST_REST_S = 0.1
PAUSE_KEYS = frozenset("pP ")


class Operator(Control):
    """A person's control: a simulation goes no faster than the wall's clock while it is paused."""

    def rest(self, period_s: float) -> None:
        """See `Control`."""
        threading.Event().wait(min(max(period_s, 0.0), LONGEST_REST_S))


@contextmanager
def operated(control: Control) -> Iterator[Control]:
    """Listen for the operator while the block runs; signals only in the main thread, keys only on a terminal."""
    with _signals(control), _keys(control):
        yield control


@contextmanager
def _signals(control: Control) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, frame: object) -> None:
        if control.stopped is not None:
            raise KeyboardInterrupt
        control.stop("asked to end (SIGTERM)")

    handlers = {signal.SIGTERM: end}
    if hasattr(signal, "SIGUSR1"):
        handlers[signal.SIGUSR1] = lambda number, frame: control.toggle()
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _keys(control: Control) -> Iterator[None]:
    """Keys without Return, and without echo; the terminal is as before afterwards."""
    try:
        import termios
        import tty
    except ImportError:  # no such terminal on this system
        yield
        return
    stdin = sys.stdin.fileno() if sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty() else -1
    if stdin < 0 or os.tcgetpgrp(stdin) != os.getpgrp():  # in the background reading would stop the process
        yield
        return
    over = threading.Event()

    def listen() -> None:
        while not over.is_set():
            ready, _, _ = select.select([stdin], [], [], LOOK_EVERY_S)
            if not ready:
                continue
            typed = os.read(stdin, 64).decode(errors="ignore")
            if not typed:
                return
            if sum(c in PAUSE_KEYS for c in typed) % 2:
                control.toggle()

    before = termios.tcgetattr(stdin)
    thread = threading.Thread(target=listen, name="keys", daemon=True)
    try:
        tty.setcbreak(stdin, termios.TCSANOW)  # Ctrl-C is still a signal
        thread.start()
        yield
    finally:
        over.set()
        thread.join()
        termios.tcsetattr(stdin, termios.TCSANOW, before)
