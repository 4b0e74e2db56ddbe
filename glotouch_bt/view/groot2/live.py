"""`glotouch run --groot2`: the tree of the run that this program starts, published by a process of its own."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from glotouch_bt.mission import Mission
from glotouch_bt.mission.export import as_monitored
from glotouch_bt.view.process import PYTHON, FollowingProcess

PUBLISHER = (*PYTHON, "glotouch_bt.view.groot2")
"""The publisher's program."""


class LiveTree(FollowingProcess):
    """The publisher of a run, in a process of its own. Use it in a `with` block around the run.

    Args:
        port: Port of the requests; the next one is opened, too.

    Attributes:
        address: The address that a monitor connects to.

    Raises:
        BadInput: A port is in use.
    """

    def __init__(self, port: int) -> None:
        super().__init__([*PUBLISHER, str(port)])

    def show(self, mission: Mission, folder: Path) -> None:
        """Publish the run of this folder, whose record may not exist yet."""
        self.tell(folder=str(folder.resolve()), tree=dataclasses.asdict(as_monitored(mission)))
