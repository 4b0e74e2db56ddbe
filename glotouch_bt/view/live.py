"""`glotouch run --live`: the page of the run that this program starts.

The page lives in a process of its own, which reads the record that the run writes. So it cannot delay a control period,
and nothing that it does reaches the run, except three words through a pipe: pause, resume, stop. The run treats them as
those of its keyboard (`Control`). A page that crashes is gone; the run goes on.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Self

from glotouch_bt.mission.execution import Control
from glotouch_bt.mission.record import to_json
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.simulation import TrueObject
from glotouch_bt.view.server import require_viser

PAGE = (sys.executable, "-P", "-m", "glotouch_bt.view")
"""The page's program; -P: it takes no module from the working folder."""
READY, FAULT, LEFT = "ready", "fault", "left"
"""First words of the lines that the page's process sends, besides the requests."""
PAUSE, RESUME, STOP = "pause", "resume", "stop"
"""Requests that the page sends."""
START_S = 60.0
"""Time in which the page's process must answer. Source: ours; its imports take 2 s on an idle machine."""
END_S = 5.0
"""Time in which the page's process must end after its input was closed."""


class LiveView:
    """The page of a run, in a process of its own. Use it in a `with` block around the run.

    Args:
        control: The run's control; the page's requests go there.
        port: Port of the loopback interface; None for the next free one.
        browser: Open the page in the browser.
        objects: Folder of STL files for the true objects of a simulation.

    Attributes:
        address: The page's address.

    Raises:
        BadInput: The port is in use, or viser is not installed.
    """

    def __init__(
        self, control: Control, *, port: int | None = None, browser: bool = True, objects: Path | None = None
    ) -> None:
        require_viser()
        self._control = control
        given = ["" if port is None else str(port), "yes" if browser else "", str(objects.resolve()) if objects else ""]
        # a session of its own: Ctrl-C ends the run first, and the page shows its end
        self._process = subprocess.Popen(
            [*PAGE, *given], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        self._answered, self._left = threading.Event(), threading.Event()
        self._fault = ""
        self.address = ""
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._threads = [threading.Thread(target=f, daemon=True) for f in (self._listen, self._write)]
        for thread in self._threads:
            thread.start()
        if not self._answered.wait(START_S) or not self.address:
            self.close()
            raise BadInput(self._fault or "the page's process did not start")

    def show(self, folder: Path) -> None:
        """Show the run of this folder, whose record may not exist yet."""
        self._tell(json.dumps({"folder": str(folder.resolve())}))

    def show_truth(self, objects: list[TrueObject]) -> None:
        """Offer the true objects of a simulation, as they stand at the start."""
        self._tell(json.dumps({"truth": to_json(objects)}))

    def wait(self) -> None:
        """Wait until nobody has the page open any more, for example after the run."""
        self._tell(json.dumps({"over": True}))
        self._left.wait()

    def close(self) -> None:
        """End the page; idempotent."""
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

    def _tell(self, line: str) -> None:
        self._lines.put(line)

    def _write(self) -> None:
        """Write lines; a page that does not read them delays this thread, never the run."""
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):  # the page is gone, and the run goes on
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
            elif word == PAUSE:
                self._control.pause()
            elif word == RESUME:
                self._control.resume()
            elif word == STOP:
                self._control.stop("stopped on the page of --live")
            elif word == LEFT:
                self._left.set()
            self._answered.set()
        self._answered.set()
        self._left.set()
