"""Detect what using an input must never do: run code, start a process, write a file, open a connection."""

from __future__ import annotations

import faulthandler
import os
import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CANARY = "glotouch_fuzz_canary"
"""Name of the file that code hidden in documents would create."""
LEAVES = ("os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "subprocess.Popen", "pty.spawn",
          "socket.connect", "socket.bind", "ctypes.dlopen")  # fmt: skip
"""Audit events (PEP 578) that leave this process."""
CHANGES = ("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod",
           "shutil.rmtree", "shutil.move", "shutil.copyfile", "shutil.copytree")  # fmt: skip
"""Audit events that change the disk; their first two arguments may be paths."""
MAX_MEMORY_BYTES = 4 * 1024**3


class TooLong(BaseException):
    """A trial did not end in time. A BaseException, so that no error handler catches it."""


class Watch:
    """An audit hook, active while a document is read and run. Hooks cannot be removed: one a process."""

    def __init__(self) -> None:
        self.seen: list[str] = []
        self._on = False
        self._writable = ""
        sys.addaudithook(self._hear)
        sys.dont_write_bytecode = True  # importing a module is no write
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        if soft == resource.RLIM_INFINITY:
            resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, hard))

    @contextmanager
    def on(self, folder: Path, seconds: float, *, writes: bool = False) -> Iterator[None]:
        """Watch for forbidden actions; raise `TooLong` after `seconds` of wall time.

        Args:
            folder: Folder of the input.
            seconds: Wall time. Compiled code that no signal interrupts ends the process after twice this time.
            writes: Files below the folder may be written; otherwise none may.
        """
        self.seen.clear()
        self._writable = f"{folder.resolve()}{os.sep}" if writes else ""
        faulthandler.dump_traceback_later(2.0 * seconds, exit=True)
        before = signal.signal(signal.SIGALRM, _alarm)
        signal.setitimer(signal.ITIMER_REAL, seconds)
        self._on = True
        try:
            yield
        finally:
            self._on = False
            faulthandler.cancel_dump_traceback_later()
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
            if (folder / CANARY).exists() or Path(CANARY).exists():
                self.seen.append("the canary file was created")

    def _hear(self, event: str, args: tuple[Any, ...]) -> None:
        if not self._on:
            return
        if event in LEAVES or (event in CHANGES and not self._may_write(args[:2])):
            self.seen.append(f"{event} {args!r:.200}")
        elif event == "open" and _opens_to_write(args) and not self._may_write(args[:1]):
            self.seen.append(f"open {args[0]!r:.100} {args[1]}")
        elif event in ("import", "compile", "exec") and CANARY in repr(args[:2]):
            self.seen.append(f"{event} {args!r:.200}")

    def _may_write(self, paths: tuple[Any, ...]) -> bool:
        """Return True if every path is below the folder of an input that may be written to, or an open file."""
        given = [os.fsdecode(p) for p in paths if isinstance(p, (str, bytes, os.PathLike))]
        inside = (os.path.realpath(os.path.dirname(p) or ".") + os.sep for p in given)
        return bool(self._writable) and all(f.startswith(self._writable) for f in inside)


def _opens_to_write(event: tuple[Any, ...]) -> bool:
    """Return True for an `open` that writes: by its mode, or by its flags (os.open)."""
    _, mode, flags = event
    if isinstance(mode, str):
        return bool(set(mode) & set("wax+"))
    return isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC))


def _alarm(number: int, frame: object) -> None:
    raise TooLong
