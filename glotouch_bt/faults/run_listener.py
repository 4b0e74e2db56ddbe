"""Inform a fault injector which nodes run and who reacts, by listening between the runner and its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from glotouch_bt.faults.injector import FaultInjector
from glotouch_bt.mission.record import Record
from glotouch_bt.robot import Command, Observation, Robot

FAILURE_EVENT, FAULT_EVENT = "failure", "fault"


class ListeningRecord:
    """A record that forwards everything and informs a fault injector of nodes and reactions.

    Args:
        record: Receives everything.
        injector: The fault injector.
    """

    def __init__(self, record: Record, injector: FaultInjector) -> None:
        self._record, self._injector = record, injector

    def block(self, observation: Observation, command: Command) -> None:
        """Forward, after the fault events of this period."""
        if self._injector.pending_events:
            events, self._injector.pending_events = self._injector.pending_events, []
            for stamp_s, data in events:
                self._record.event(FAULT_EVENT, stamp_s, data)
        self._record.block(observation, command)

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Forward; inform the injector which nodes run."""
        for path, _, new in changes:
            if str(getattr(new, "value", new)) == "RUNNING":
                self._injector.on_node_started(path, stamp_s)
            else:
                self._injector.on_node_ended(path)
        self._record.tick(stamp_s, changes)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Forward; inform the injector who reacts."""
        if kind == FAILURE_EVENT:
            self._injector.add_sighting(stamp_s, str(data["node"]), str(data["code"]), str(data["message"]))
        elif kind == "guard":
            # A guard stamps its finding with the last trusted sample; the reaction happens now.
            known_s = max(stamp_s, self._injector.now_s)
            words = str(data.get("what", data.get("text", "")))
            self._injector.add_sighting(known_s, "supervision", str(data.get("guard", data.get("code", ""))), words)
        self._record.event(kind, stamp_s, data)

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Forward."""
        self._record.port(stamp_s, key, value)


def injector_in(robot: Robot) -> FaultInjector | None:
    """Return the robot if it is a fault injector, else None."""
    return robot if isinstance(robot, FaultInjector) else None
