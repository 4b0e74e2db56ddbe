"""Stop a faulted trial once it equals its unfaulted twin bit for bit; its end is then known.

At every checkpoint after the fault, the simulated world and the mission's state are compared with the twin's checkpoint
of the same number. If the bytes are equal, the rest is the same run: simulation, sensor noise and tree are
deterministic, and supervision remembers only one second of findings.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from glotouch_bt.faults import FaultPlan
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile, CheckpointRow, decode, encode
from glotouch_bt.robot import BadInput

KNOWN = ("tree", "arm", "preempted", "paused_s", "status", "ticks", "requests")
"""State that decides how a mission continues, besides ports and world."""


class Rejoined(Exception):
    """The trial equals its twin again."""


class TwinWatch(CheckpointFile):
    """Checkpoints of a trial that stops once it equals its twin.

    Args:
        folder: The trial's folder.
        twin: The twin's.
        plan: The trial's plan with one fault that occurs once.
        begins_s: Robot clock when the fault begins.
    """

    def __init__(self, folder: Path, twin: Path, plan: FaultPlan, begins_s: float) -> None:
        super().__init__(folder / CHECKPOINT_FILE)
        self._twin = CheckpointFile(twin / CHECKPOINT_FILE)
        self._stamps = {(r.number, r.stamp_s) for r in self._twin.rows()}
        (spec,) = plan.faults
        duration = spec.duration
        self._begins_s, self._node = begins_s, str(spec.when.node)
        self._until_node = duration.until == "node"
        self._over_s = math.inf if duration.until is not None else begins_s + (duration.duration_s or 0.0)
        if duration.cycles is not None:
            self._over_s = begins_s + 1.0

    def add(self, row: CheckpointRow, state: bytes, world: bytes | None) -> None:
        """See `CheckpointFile`.

        Raises:
            Rejoined: The fault is over and without any effect left.
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

    def _same(self, row: CheckpointRow, state: bytes, world: bytes) -> bool:
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
