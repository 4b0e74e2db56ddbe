"""Drivers of simulated devices by `fork`: each begins with everything imported, which is most of what its start takes.

For tests of what a driver does. That it starts as a program of its own is tested in `integration/simulated_devices`.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from glotouch_backends.flexiv_xense.client import process
from glotouch_backends.flexiv_xense.driver.__main__ import main

HIGHEST_FILE = 4096


class Forked:
    """A child of this process, with what `DriverProcess` uses of `subprocess.Popen`.

    Args:
        run: What the child does; its value is the child's exit code.
        output: File of what it prints.
    """

    def __init__(self, run: Callable[[], int], output: int) -> None:
        self._code: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            _become(run, output)

    def poll(self) -> int | None:
        """The exit code, minus the number of the signal that ended it, or None while it runs."""
        if self._code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self._code = os.waitstatus_to_exitcode(status) if pid else None
        return self._code

    def wait(self, timeout: float) -> int:
        """Wait for its end.

        Raises:
            subprocess.TimeoutExpired: It has not ended by then.
        """
        end = time.perf_counter() + timeout
        while (code := self.poll()) is None:
            if time.perf_counter() > end:
                raise subprocess.TimeoutExpired("a forked driver", timeout)
            time.sleep(0.002)
        return code

    def kill(self) -> None:
        if self.poll() is None:
            os.kill(self.pid, signal.SIGKILL)


def _become(run: Callable[[], int], output: int) -> None:
    """Run in the child, as in a session of its own without the parent's files, and end."""
    code = 70
    try:
        os.setsid()
        with open(os.devnull) as nothing:
            os.dup2(nothing.fileno(), 0)
        for out in (1, 2):
            os.dup2(output, out)
        os.closerange(3, HIGHEST_FILE)
        sys.stdout, sys.stderr = (os.fdopen(out, "w", buffering=1) for out in (1, 2))
        code = run()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def fork_drivers(setattr_: Callable[[object, str, Any], None]) -> None:
    """Fork drivers from here on; `setattr_` is that of a monkeypatch."""
    start = subprocess.Popen

    def begin(command: Sequence[str], *, stdout: Any, **rest: Any) -> Any:
        if command[:3] != [sys.executable, "-m", process.HERE]:
            return start(command, stdout=stdout, **rest)
        return Forked(lambda: main(list(command[3:])), stdout.fileno())

    setattr_(process.subprocess, "Popen", begin)
