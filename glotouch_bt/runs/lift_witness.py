"""Note what every lift of a simulated run raised, for scoring only: a wrong object that was put back counts, too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from glotouch_bt.mission.record import Record
from glotouch_bt.robot import Command, Observation
from glotouch_bt.robot.simulation import Referee

LIFT_EVENT = "lift"
"""Kind of the event with which a skill tells that it has raised the jaws."""


class LiftWitness:
    """A record that forwards everything and asks the referee at every lift what the jaws hold.

    Args:
        record: Receives everything.
        referee: The truth; None on hardware.

    Attributes:
        lifted: One {stamp_s, node, object} for every lift, `object` None if the jaws hold none. A resumed run has the
            lifts since then.
    """

    def __init__(self, record: Record, referee: Referee | None) -> None:
        self._record, self._referee = record, referee
        self.lifted: list[dict[str, object]] = []

    def block(self, observation: Observation, command: Command) -> None:
        """Forward."""
        self._record.block(observation, command)

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Forward."""
        self._record.tick(stamp_s, changes)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Forward, and look."""
        self._record.event(kind, stamp_s, data)
        if kind == LIFT_EVENT and self._referee is not None:
            self.lifted.append({"stamp_s": round(stamp_s, 3), "node": data.get("node"), "object": self._held()})

    def _held(self) -> str | None:
        try:
            return next((o.name for o in self._referee.objects() if o.in_gripper), None) if self._referee else None
        except Exception:  # a dead simulation must not end the mission in its place
            return None

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Forward."""
        self._record.port(stamp_s, key, value)
