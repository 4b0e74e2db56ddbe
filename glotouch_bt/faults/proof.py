"""Proof of effect: what a fault changed, who saw it, how soon, and how the run ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from glotouch_bt.faults.effects import Actions
from glotouch_bt.faults.plan import FaultSpec

MAX_LISTED = 50
"""Starts, ends, notes and sightings listed per fault."""
MAX_RECOVERY = 8
"""Nodes listed after the first sighting."""


@dataclass(frozen=True)
class Sighting:
    """A reaction of a skill, the supervision, the device or the runner.

    Attributes:
        stamp_s: Robot clock.
        by: Name of the node, or `device`, `supervision`, `runner`.
        code: A skill's failure code, a guard's name, or an error's class.
        text: The message.
    """

    stamp_s: float
    by: str
    code: str
    text: str

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {"stamp_s": round(self.stamp_s, 6), "by": self.by, "code": self.code, "text": self.text}


@dataclass
class Proof:
    """The effect of one fault of a plan.

    Attributes:
        spec: The requested fault.
        actions: Effects other than altered samples and commands.
        begun_s, ended_s: Robot clock of each start and end.
        nodes: The node that ran at each start.
        samples: Samples that differ from what the device delivered.
        commands: Commands that differ from what was sent.
        refused: Commands that the fault answered with an error.
        first_s, last_s: Robot clock of the first and the last change.
    """

    spec: FaultSpec
    actions: Actions
    begun_s: list[float] = field(default_factory=list)
    ended_s: list[float] = field(default_factory=list)
    nodes: list[str] = field(default_factory=list)
    samples: int = 0
    commands: int = 0
    refused: int = 0
    first_s: float | None = None
    last_s: float | None = None

    @property
    def changes(self) -> int:
        """Number of changes of every kind; 0 if it had no effect."""
        return self.samples + self.commands + self.refused + self.actions.count

    def changed(self, now_s: float) -> None:
        """Note a change in this period."""
        if self.first_s is None:
            self.first_s = now_s
        self.last_s = now_s

    def report(self, sightings: list[Sighting], started: list[tuple[float, str]], outcome: str) -> dict[str, Any]:
        """Return the entry of result.json.

        Args:
            sightings: All sightings of the run, in order of time.
            started: (robot clock, path) of nodes that started after the first sighting, in order of time.
            outcome: How the run ended.
        """
        first = self.first_s
        after = [] if first is None else [s for s in sightings if s.stamp_s >= first - 1e-9]
        seen = after[0] if after else None
        return {
            "name": self.spec.name,
            "fault": self.spec.kind.name,
            "channel": self.spec.kind.channel,
            "requested": self.spec.requested(),
            "applied": len(self.begun_s),
            "begun_s": [round(s, 6) for s in self.begun_s[:MAX_LISTED]],
            "ended_s": [round(s, 6) for s in self.ended_s[:MAX_LISTED]],
            "nodes": sorted(set(self.nodes)),
            "samples_altered": self.samples,
            "commands_altered": self.commands,
            "commands_refused": self.refused,
            "acts": self.actions.count,
            "moved_m": round(self.actions.moved_m, 6),
            "notes": self.actions.notes[:MAX_LISTED],
            "effective": self.changes > 0,
            "first_s": None if first is None else round(first, 6),
            "last_s": None if self.last_s is None else round(self.last_s, 6),
            "seen": None if seen is None else seen.as_dict(),
            "latency_s": None if seen is None or first is None else round(seen.stamp_s - first, 6),
            "sightings": [s.as_dict() for s in after[:MAX_LISTED]],
            "recovery": [] if seen is None else _leaves(started, seen.stamp_s)[:MAX_RECOVERY],
            "outcome": outcome,
        }


def _leaves(started: list[tuple[float, str]], since_s: float) -> list[str]:
    """Return the names of the leaves that started after a time."""
    later = [path for stamp_s, path in started if stamp_s > since_s - 1e-9]
    return [p.rsplit("/", 1)[-1] for p in later if not any(q.startswith(p + "/") for q in later)]
