"""Detect what reading a document must never do: run code, start a process, write a file, open a connection."""

from __future__ import annotations

import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CANARY = "glotouch_fuzz_canary"
"""Name of the file that code hidden in documents would create."""
PROCESSES = ("os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "subprocess.Popen", "pty.spawn",
             "socket.connect", "socket.bind", "ctypes.dlopen", "os.remove", "os.rename", "shutil.rmtree")  # fmt: skip
"""Audit events (PEP 578) that leave this process or change the disk."""
MAX_MEMORY_BYTES = 4 * 1024**3


class TooLong(BaseException):
    """A trial did not end in time. A BaseException, so that no error handler catches it."""


class Watch:
    """An audit hook, active while a document is read and run. Hooks cannot be removed: one a process."""

    def __init__(self) -> None:
        self.seen: list[str] = []
        self._on = False
        sys.addaudithook(self._hear)
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        if soft == resource.RLIM_INFINITY:
            resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, hard))

    @contextmanager
    def on(self, folder: Path, seconds: float) -> Iterator[None]:
        """Watch for forbidden actions; raise `TooLong` after `seconds` of wall time.

        Args:
            folder: Folder of the document; nothing may be written there either.
            seconds: Wall time.
        """
        self.seen.clear()
        before = signal.signal(signal.SIGALRM, _alarm)
        signal.setitimer(signal.ITIMER_REAL, seconds)
        self._on = True
        try:
            yield
        finally:
            self._on = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
            if (folder / CANARY).exists() or Path(CANARY).exists():
                self.seen.append("the canary file was created")

    def _hear(self, event: str, args: tuple[Any, ...]) -> None:
        if not self._on:
            return
        if event in PROCESSES:
            self.seen.append(f"{event} {args!r:.200}")
        elif event == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+"):
            self.seen.append(f"open {args[0]!r:.100} {args[1]}")
        elif event in ("import", "compile", "exec") and CANARY in repr(args[:2]):
            self.seen.append(f"{event} {args!r:.200}")


def _alarm(number: int, frame: object) -> None:
    raise TooLong
