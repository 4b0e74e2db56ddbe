"""Watch one run: read its record as it grows, and draw it until someone ends the view."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glotouch_bt.report import TRUTH_NAME
from glotouch_bt.report.state import Player, RunModel, planned_nodes, read_setup, true_bodies
from glotouch_bt.robot import BadInput
from glotouch_bt.untrusted import read_json
from glotouch_bt.view.follow import RecordFollower
from glotouch_bt.view.page import AT_END, AT_START, MissionControls, Page

if TYPE_CHECKING:
    import viser

    from glotouch_bt.report.state import GhostObject

FRAME_S = 0.05
"""Wall time between two drawings. Source: ours; 20 a second look fluid; one costs 4 ms, while something moves."""
SILENT_S = 8.0
"""Wall time without a new entry after which the page says so. Source: ours; a record grows by 0.5 s."""

ENDS = {"success": ("succeeded", "good"), "failure": ("failed", "bad"), "aborted": ("was aborted", "warn")}
"""Words and tone of each end of a mission."""


class RunWatch:
    """A page that shows a run's folder.

    Args:
        server: An empty page.
        folder: The run's folder; the record may not exist yet.
        controls: Requests to the mission, if it is this program's own.
        objects: Folder of STL files for the true objects, instead of the shipped ones.
        from_run: Its `truth`, once there is one, is the list of true objects at the start of a run under way.

    Attributes:
        page: The page.
        player: Its clock.
        viewers: Number of browsers that show the page; -1 before the first drawing.
        was_viewed: A browser has shown it.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        folder: Path,
        controls: MissionControls | None = None,
        objects: Path | None = None,
        from_run: Mapping[str, Any] | None = None,
    ) -> None:
        self._server, self._folder, self._objects = server, folder, objects
        self._from_run = from_run or {}
        self.player = Player(live=True)
        self.page = Page(server, self.player, controls)
        self._model = RunModel()
        self._follower = RecordFollower(folder)
        self._records = 0
        self._begun = False
        self._grown_s = time.perf_counter()
        self._truth_stamp = -1.0
        self._fault = ""
        self._shown: tuple[object, ...] = ()
        self.viewers = -1
        self.was_viewed = False

    def run(self, over: threading.Event) -> None:
        """Read and draw until `over` is set."""
        before = time.perf_counter()
        with ExitStack() as closing:
            closing.callback(self.close)
            while not over.wait(max(0.01, FRAME_S - (time.perf_counter() - before))):
                now = time.perf_counter()
                self.step(now - before)
                before = now

    def close(self) -> None:
        """Close the record."""
        self._follower.close()

    def step(self, wall_s: float) -> None:
        """Read what is new, and draw the state after `wall_s` of wall time."""
        try:
            self._read()
            self._fault = ""
        except BadInput as e:
            self._fault = str(e)
        model = self._model
        viewers = len(self._server.get_clients())
        t_s = self.player.advance(wall_s, model.span_s, growing=not model.ended)
        note = self._note()
        clock = (t_s, model.span_s, self.player.speed, self.player.moving)
        shown = (clock, model, note, self.page.switches, self._truth_stamp)
        if viewers != self.viewers or (viewers and shown != self._shown):  # without a viewer only the record is read
            self.page.draw(model.state_at(t_s), *note)
            self._shown = shown
        self.viewers, self.was_viewed = viewers, self.was_viewed or viewers > 0

    def _read(self) -> None:
        follower = self._follower
        grown = follower.read()
        if follower.records != self._records:  # the first record, or that of a resumed run
            self._records = follower.records
            self._model, self._begun = RunModel(planned_nodes(self._folder)), False
            self.player.begin()
        if follower.reader is None:
            return
        if grown:
            self._grown_s = time.perf_counter()
            self._model.feed(follower.reader)
            if not self._begun and follower.reader.record.run:
                self._begun = True
                self.page.begin(self._model, read_setup(follower.reader.record, self._objects))
        self._read_truth()

    def _read_truth(self) -> None:
        path = self._folder / TRUTH_NAME
        try:
            stamp = path.stat().st_mtime
        except OSError:
            stamp = 0.0 if "truth" in self._from_run else -1.0
        if stamp == self._truth_stamp:
            return
        self._truth_stamp = stamp
        truth = read_json(path) if stamp > 0.0 else {"start": self._from_run.get("truth")}
        found: dict[str, tuple[GhostObject, ...]] = {}
        for word, key in ((AT_START, "start"), (AT_END, "end")):
            bodies = tuple(true_bodies(truth.get(key))) if isinstance(truth, dict) else ()
            if bodies:
                found[word] = bodies
        self.page.set_truth(found)

    def _note(self) -> tuple[str, str]:
        """Return the sentence below the head, and its tone."""
        if self._fault:
            return self._fault, "bad"
        model = self._model
        if model.ended and model.record is not None:
            result = model.record.result
            words, tone = ENDS.get(str(result.get("status")), ("has no result", "bad"))
            reasons = result.get("reasons")
            node, colon, text = str(reasons[-1] if isinstance(reasons, list) and reasons else "").partition(": ")
            why = f": {node.rsplit('/', 1)[-1]}{colon}{text}" if node else ""
            here = self.player.t_s >= model.span_s[1] - 0.01
            return f"{'the mission' if here else 'in the end the mission'} {words}{why}", tone
        silent_s = time.perf_counter() - self._grown_s
        if silent_s > SILENT_S:
            return f"no new entry for {silent_s:.0f} s: the mission computes, or its process is gone", "warn"
        return "", ""
