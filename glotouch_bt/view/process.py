"""A process beside the run: it follows the record that the run writes, and speaks with the run through a pipe.

Lines to it are JSON objects; its own lines begin with a word. A process that hangs or crashes cannot delay a control
period, and it ends with the run, however the run ends.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any, Self

from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import parse_json

READY, FAULT = "ready", "fault"
"""First words of the line that such a process sends first: with its address, or with the reason why it cannot start."""
START_S = 60.0
"""Time in which the process must send its first line. Source: ours; long enough for its imports on a busy machine."""
END_S = 5.0
"""Time in which the process must end after its input was closed."""
PYTHON = (sys.executable, "-P", "-m")
"""Command that runs a module of ours as a program; -P: it takes no module from the working folder."""
NICENESS = 10
"""The control loop goes before such a process when both want a core."""


class FollowingProcess:
    """The run's end of the pipe. Use it in a `with` block around the run.

    Args:
        command: The program and its arguments.
        on_word: Called with each word that the process sends after its first line.
        on_end: Called when the process has ended.

    Attributes:
        address: The address that the process serves.

    Raises:
        BadInput: The process says why it cannot start, or does not start.
    """

    def __init__(
        self,
        command: Sequence[str],
        on_word: Callable[[str], None] = lambda _: None,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        self._on_word, self._on_end = on_word, on_end
        # a session of its own: Ctrl-C ends the run first, and the process shows its end
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        self._answered = threading.Event()
        self._fault = ""
        self.address = ""
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._threads = [threading.Thread(target=f, daemon=True) for f in (self._listen, self._write)]
        for thread in self._threads:
            thread.start()
        if not self._answered.wait(START_S) or not self.address:
            self.close()
            raise BadInput(self._fault or "the process beside the run did not start")

    def tell(self, **told: Any) -> None:
        """Send an object of JSON data; never blocks."""
        self._lines.put(json.dumps(told))

    def close(self) -> None:
        """End the process; idempotent."""
        self._lines.put(None)
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for thread in self._threads:
            thread.join(END_S)
        if self._process.stdout is not None:
            self._process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _write(self) -> None:
        """Write lines; a process that does not read them delays this thread, never the run."""
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):  # the process is gone, and the run goes on
            while (line := self._lines.get()) is not None:
                self._process.stdin.write(f"{line}\n")
                self._process.stdin.flush()
        with suppress(OSError):
            self._process.stdin.close()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            word, _, rest = line.strip().partition(" ")
            if word == READY:
                self.address = rest
            elif word == FAULT:
                self._fault = rest
            else:
                self._on_word(word)
            self._answered.set()
        self._answered.set()
        self._on_end()


class RunLink:
    """The process's end of the pipe: what the run tells.

    Attributes:
        told: Everything told so far, one mapping; a newer value replaces an older one.
        named: Set when the first line has come, or the run has ended: its folder is known.
        finished: Set when the run says that it is over; it may still wait for this process.
        ended: Set when the pipe is closed: this process must end.
    """

    def __init__(self) -> None:
        os.nice(NICENESS)
        self._out = os.dup(1)  # nothing but our lines goes to the run, also not what a browser writes
        os.dup2(2, 1)
        self.told: dict[str, Any] = {}
        self.named, self.finished, self.ended = threading.Event(), threading.Event(), threading.Event()

    def tell(self, line: str) -> None:
        """Send one line to the run."""
        with suppress(OSError):  # the run is gone
            os.write(self._out, f"{line}\n".encode())

    def begin(self, address: str) -> Path | None:
        """Tell the run the address that is served, and wait for its folder; None if the run ended before."""
        threading.Thread(target=self._listen, daemon=True).start()
        self.tell(f"{READY} {address}")
        self.named.wait()
        return None if self.ended.is_set() else Path(self.told["folder"])

    def _listen(self) -> None:
        for line in sys.stdin:
            self.told.update(parse_json(line.encode(), "the run"))
            (self.finished if "over" in self.told else self.named).set()
        self.ended.set()
        self.named.set()
