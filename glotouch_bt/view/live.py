"""`glotouch run --live`: the page of the run that this program starts.

The page lives in a process of its own, which reads the record that the run writes. Nothing of it reaches the run,
except three words through a pipe: pause, resume, stop. The run treats them as those of its keyboard (`Control`). A page
that crashes is gone; the run goes on.
"""

from __future__ import annotations

import threading
from pathlib import Path

from glotouch_bt.mission.execution import Control
from glotouch_bt.mission.record import to_json
from glotouch_bt.robot.simulation import TrueObject
from glotouch_bt.view.process import PYTHON, FollowingProcess
from glotouch_bt.view.server import require_viser

PAGE = (*PYTHON, "glotouch_bt.view")
"""The page's program."""
LEFT, UNSEEN = "left", "unseen"
"""Words of the page's process: the run is over, and nobody has the page open any more; nobody ever had."""
PAUSE, RESUME, STOP = "pause", "resume", "stop"
"""Requests that the page sends."""


class LiveView(FollowingProcess):
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
        self._left = threading.Event()
        self._viewed = False
        given = ["" if port is None else str(port), "yes" if browser else "", str(objects.resolve()) if objects else ""]
        super().__init__([*PAGE, *given], self._obey, self._left.set)

    def show(self, folder: Path) -> None:
        """Show the run of this folder, whose record may not exist yet."""
        self.tell(folder=str(folder.resolve()))

    def show_truth(self, objects: list[TrueObject]) -> None:
        """Offer the true objects of a simulation, as they stand at the start."""
        self.tell(truth=to_json(objects))

    def wait(self, *, patient: bool) -> bool:
        """Wait until nobody has the page open any more, for example after the run; return True if anybody had it open.

        Args:
            patient: Wait for the first viewer if there was none yet.
        """
        self.tell(over=True, patient=patient)
        self._left.wait()
        return self._viewed

    def _obey(self, word: str) -> None:
        if word == PAUSE:
            self._control.pause()
        elif word == RESUME:
            self._control.resume()
        elif word == STOP:
            self._control.stop("stopped on the page of --live")
        elif word in (LEFT, UNSEEN):
            self._viewed = word == LEFT
            self._left.set()
