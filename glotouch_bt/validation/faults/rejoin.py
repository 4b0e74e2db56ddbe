"""A faulted trial that is its unfaulted twin again, bit for bit, needs not be run to its end: that is known.

At every checkpoint after the fault is over, the simulated world and all that the mission knows are compared with the
twin's checkpoint of the same number. Where both are the same bytes, the rest is the same run: the simulation, the
sensors' noise in it and the tree are deterministic, and supervision only remembers a second of findings.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from glotouch_bt.faults import FaultPlan
from glotouch_bt.mission.checkpoint import FILE, CheckpointFile, Row, decode, encode
from glotouch_bt.robot import BadInput

KNOWN = ("tree", "arm", "preempted", "paused_s", "status", "ticks", "requests")
"""What decides how a mission goes on, besides ports and world; counts and reasons do not."""


class Rejoined(Exception):
    """The trial is its twin again."""


class TwinWatch(CheckpointFile):
    """The checkpoints of a trial, which breaks off once it is its twin again.

    Args:
        path: The trial's file.
        twin: The twin's.
        plan: The trial's plan, of one fault that comes once.
        begins_s: Robot clock when the fault begins.
    """

    def __init__(self, path: Path, twin: Path, plan: FaultPlan, begins_s: float) -> None:
        super().__init__(path)
        self._twin = CheckpointFile(twin)
        self._stamps = {(r.number, r.stamp_s) for r in self._twin.rows()}
        (spec,) = plan.faults
        lasting = spec.lasting
        self._begins_s, self._node = begins_s, str(spec.when.node)
        self._until_node = lasting.until == "node"
        self._over_s = math.inf if lasting.until is not None else begins_s + (lasting.duration_s or 0.0)
        if lasting.cycles is not None:
            self._over_s = begins_s + 1.0

    def add(self, row: Row, state: bytes, world: bytes | None) -> None:
        """See `CheckpointFile`.

        Raises:
            Rejoined: The fault is over, and nothing is left of it.
        """
        super().add(row, state, world)
        if row.stamp_s > self._over_s and world is not None and self._same(row, state, world):
            raise Rejoined(f"the same as its twin from checkpoint {row.number} on")
        if self._until_node and row.stamp_s >= self._begins_s and row.node.rsplit("/", 1)[-1] == self._node:
            self._over_s = row.stamp_s

    def close(self) -> None:
        """See `CheckpointFile`."""
        super().close()
        self._twin.close()

    def _same(self, row: Row, state: bytes, world: bytes) -> bool:
        try:
            if (row.number, row.stamp_s) not in self._stamps:
                return False
            there = self._twin.world(row.number)
            if there is None or encode(there) != world:
                return False
            mine = decode(state)
            return isinstance(mine, dict) and _known(mine) == _known(self._twin.state(row.number))
        except BadInput:
            return False


def _known(state: dict[str, Any]) -> bytes:
    return encode({k: v for k, v in sorted(state.items()) if k in KNOWN or k.startswith(("port ", "recorded"))})


def watched(folder: Path, twin: Path, plan: FaultPlan, begins_s: float) -> TwinWatch:
    """The checkpoints of a trial in `folder` beside its twin's."""
    return TwinWatch(folder / FILE, twin / FILE, plan, begins_s)
