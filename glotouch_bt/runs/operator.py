"""The operator of a running mission: signals and keys become calls of its `Control`.

SIGUSR1 pauses or continues the mission, and so does the key `p` on a terminal. SIGTERM ends the mission safely; a
second SIGTERM ends it at once. SIGHUP (the terminal was closed) ends it safely as well.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from glotouch_bt.mission.execution import Control

KEY_PERIOD_S = 0.1
"""Time between two looks at the keyboard."""
MAX_REST_S = 0.1
"""Longest sleep of one control period while the mission is paused."""
PAUSE_KEYS = frozenset("pP ")
LFLAG = 3
"""Index of the local flags in the list that `termios.tcgetattr` returns."""


class Operator(Control):
    """A `Control` for a person: a paused simulation runs no faster than real time."""

    def rest(self, period_s: float) -> None:
        """Sleep for one control period (see `Control`)."""
        threading.Event().wait(min(max(period_s, 0.0), MAX_REST_S))


@contextmanager
def operated(control: Control) -> Iterator[Control]:
    """Listen to the operator while the block runs: signals in the main thread only, keys on a terminal only."""
    with _signals(control), _keys(control):
        yield control


@contextmanager
def _signals(control: Control) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, frame: object) -> None:
        if control.stopped is None:
            control.stop("asked to end (SIGTERM)")
        else:  # same as Ctrl-C twice: the runner's own handler ends the mission at once
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    handlers = {signal.SIGTERM: end}
    if hasattr(signal, "SIGUSR1"):
        handlers[signal.SIGUSR1] = lambda number, frame: control.toggle()
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # nohup
        handlers[signal.SIGHUP] = lambda number, frame: control.stop("asked to end (SIGHUP: its terminal was closed)")
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _keys(control: Control) -> Iterator[None]:
    """Read keys without Return and without echo; restore the terminal afterwards."""
    try:
        import termios
        import tty
    except ImportError:  # not a POSIX system
        yield
        return
    stdin = sys.stdin.fileno() if sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty() else -1
    if stdin < 0:
        yield
        return
    over = threading.Event()

    def in_foreground() -> bool:
        """Return True if this process owns the terminal; in the background, a read would stop the mission (SIGTTIN)."""
        return os.tcgetpgrp(stdin) == os.getpgrp()

    def listen() -> None:
        while not over.is_set():
            if not in_foreground():
                over.wait(KEY_PERIOD_S)
                continue
            if termios.tcgetattr(stdin)[LFLAG] & termios.ICANON:  # at the start, and after Ctrl-Z and fg
                tty.setcbreak(stdin, termios.TCSANOW)  # cbreak keeps Ctrl-C a signal
            ready, _, _ = select.select([stdin], [], [], KEY_PERIOD_S)
            if not ready or not in_foreground():
                continue
            typed = os.read(stdin, 64).decode(errors="ignore")
            if not typed:
                return
            if sum(c in PAUSE_KEYS for c in typed) % 2:
                control.toggle()

    def listen_until_hung_up() -> None:
        with suppress(OSError, termios.error):  # the terminal was hung up; SIGHUP reports it as well
            listen()

    before = termios.tcgetattr(stdin)
    thread = threading.Thread(target=listen_until_hung_up, name="keys", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        with suppress(OSError, termios.error):
            if in_foreground():
                termios.tcsetattr(stdin, termios.TCSANOW, before)
