"""Ctrl-C that Python ignores."""

from __future__ import annotations

import signal
import sys
import threading

AGAIN_S = 0.01


def repeat_lost_interrupts() -> None:
    """Raise KeyboardInterrupt again in the main thread where Python ignores it.

    Python ignores whatever is raised in a finalizer or in the callback of a weak reference. The handler of Ctrl-C may
    run in one of them.
    """
    sys.unraisablehook = _on_unraisable


def _on_unraisable(lost: sys.UnraisableHookArgs) -> None:
    if lost.exc_type is KeyboardInterrupt:
        # A signal to the main thread also ends its wait for a lock or an event.
        threading.Timer(AGAIN_S, signal.pthread_kill, (threading.main_thread().ident, signal.SIGINT)).start()
    else:
        sys.__unraisablehook__(lost)
