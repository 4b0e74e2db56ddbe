"""The operator of a running mission: signals and keys become calls of its `Control`.

SIGUSR1 pauses and goes on; SIGTERM ends the mission safely, a second one at once; so does SIGHUP, when its terminal is
closed; `p` on a terminal is SIGUSR1.
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

LOOK_EVERY_S = 0.1
LONGEST_REST_S = 0.1
PAUSE_KEYS = frozenset("pP ")
LFLAG = 3
"""Of what `termios.tcgetattr` gives."""


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
        if control.stopped is None:
            control.stop("asked to end (SIGTERM)")
        else:  # at once: as Ctrl-C twice, for whoever listens to that now
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
    """Keys without Return, and without echo; the terminal is as before afterwards."""
    try:
        import termios
        import tty
    except ImportError:  # no such terminal on this system
        yield
        return
    stdin = sys.stdin.fileno() if sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty() else -1
    if stdin < 0:
        yield
        return
    over = threading.Event()

    def ours() -> bool:
        """In the background, whoever reads the terminal or sets it is stopped, with the mission."""
        return os.tcgetpgrp(stdin) == os.getpgrp()

    def listen() -> None:
        while not over.is_set():
            if not ours():
                over.wait(LOOK_EVERY_S)
                continue
            if termios.tcgetattr(stdin)[LFLAG] & termios.ICANON:  # at first, and after the shell had it (Ctrl-Z, fg)
                tty.setcbreak(stdin, termios.TCSANOW)  # Ctrl-C is still a signal
            ready, _, _ = select.select([stdin], [], [], LOOK_EVERY_S)
            if not ready or not ours():
                continue
            typed = os.read(stdin, 64).decode(errors="ignore")
            if not typed:
                return
            if sum(c in PAUSE_KEYS for c in typed) % 2:
                control.toggle()

    def listen_while_there_is_a_terminal() -> None:
        with suppress(OSError, termios.error):  # it was hung up: SIGHUP says so, too
            listen()

    before = termios.tcgetattr(stdin)
    thread = threading.Thread(target=listen_while_there_is_a_terminal, name="keys", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        with suppress(OSError, termios.error):
            if ours():
                termios.tcsetattr(stdin, termios.TCSANOW, before)
