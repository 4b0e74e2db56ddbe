"""What a fault plan must know of a run: which node runs, and who reacts. Stands between the runner and its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from glotouch_bt.faults.injector import FaultInjector
from glotouch_bt.mission.record import Record
from glotouch_bt.robot import Command, Observation, Robot

FAILURE_EVENT, FAULT_EVENT = "failure", "fault"


class ListeningRecord:
    """A record that passes everything on, and tells a fault injector of nodes and reactions.

    Args:
        record: Where everything goes.
        injector: Who is told.
        reactions: Kinds of events that mean that something was noticed, besides a skill's failure.
    """

    def __init__(self, record: Record, injector: FaultInjector, reactions: tuple[str, ...] = ("guard",)) -> None:
        self._record, self._injector, self._reactions = record, injector, reactions

    def block(self, observation: Observation, command: Command) -> None:
        """Passed on, after what became of the faults in this period."""
        if self._injector.news:
            news, self._injector.news = self._injector.news, []
            for stamp_s, data in news:
                self._record.event(FAULT_EVENT, stamp_s, data)
        self._record.block(observation, command)

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Passed on; the injector learns which nodes run."""
        for path, _, new in changes:
            if str(getattr(new, "value", new)) == "RUNNING":
                self._injector.node_began(path, stamp_s)
            else:
                self._injector.node_ended(path)
        self._record.tick(stamp_s, changes)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Passed on; the injector learns who reacts."""
        if kind == FAILURE_EVENT:
            self._injector.saw(stamp_s, str(data["node"]), str(data["code"]), str(data["message"]))
        elif kind in self._reactions:
            # A guard dates what it found by the last sample it trusted: it knew of it now.
            known_s = max(stamp_s, self._injector.now_s)
            words = str(data.get("what", data.get("text", "")))
            self._injector.saw(known_s, "supervision", str(data.get("guard", data.get("code", ""))), words)
        self._record.event(kind, stamp_s, data)

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Passed on."""
        self._record.port(stamp_s, key, value)


def injector_in(robot: Robot) -> FaultInjector | None:
    """The fault injector in a chain of wrappers, or None."""
    seen: object = robot
    while seen is not None and not isinstance(seen, FaultInjector):
        seen = getattr(seen, "inner", None)
    return seen
