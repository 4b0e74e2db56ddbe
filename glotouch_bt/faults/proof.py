"""Proof of effect: what a fault really changed, who saw it, how soon, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from glotouch_bt.faults.effects import Acts
from glotouch_bt.faults.plan import FaultSpec

KEPT = 50  # beginnings and sightings that are written out
FIRST = 8  # nodes after the first sighting that are


@dataclass(frozen=True)
class Sighting:
    """Something below or in the tree reacted.

    Attributes:
        stamp_s: Robot clock.
        by: The node, or `device`, `supervision`, `runner`.
        code: Short stable word: a skill's failure code, a guard's name, an error's class.
        text: In words.
    """

    stamp_s: float
    by: str
    code: str
    text: str

    def as_dict(self) -> dict[str, Any]:
        """As JSON data."""
        return {"stamp_s": round(self.stamp_s, 6), "by": self.by, "code": self.code, "text": self.text}


@dataclass
class Proof:
    """What became of one fault of a plan.

    Attributes:
        spec: What was asked for.
        begun_s, ended_s: Robot clock when it began and ended, each time.
        nodes: The node that ran when it began, each time.
        samples: Samples that differ from what the device delivered.
        commands: Commands that differ from what was sent.
        refused: Commands that an error of the fault answered.
        acts: What it did otherwise.
        first_s, last_s: Robot clock of the first and the last change.
    """

    spec: FaultSpec
    acts: Acts
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
        """Everything it changed, counted; 0: it did nothing."""
        return self.samples + self.commands + self.refused + self.acts.times

    def changed(self, now_s: float) -> None:
        """It changed something in this period."""
        if self.first_s is None:
            self.first_s = now_s
        self.last_s = now_s

    def report(self, sightings: list[Sighting], began: list[tuple[float, str]], outcome: str) -> dict[str, Any]:
        """As result.json has it.

        Args:
            sightings: All of the run, in order of time.
            began: (robot clock, path) of nodes that began after the first of them, in order of time.
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
            "begun_s": [round(s, 6) for s in self.begun_s[:KEPT]],
            "ended_s": [round(s, 6) for s in self.ended_s[:KEPT]],
            "nodes": sorted(set(self.nodes)),
            "samples_altered": self.samples,
            "commands_altered": self.commands,
            "commands_refused": self.refused,
            "acts": self.acts.times,
            "moved_m": round(self.acts.moved_m, 6),
            "notes": self.acts.notes[:KEPT],
            "effective": self.changes > 0,
            "first_s": None if first is None else round(first, 6),
            "last_s": None if self.last_s is None else round(self.last_s, 6),
            "seen": None if seen is None else seen.as_dict(),
            "latency_s": None if seen is None or first is None else round(seen.stamp_s - first, 6),
            "sightings": [s.as_dict() for s in after[:KEPT]],
            "recovery": [] if seen is None else _leaves(began, seen.stamp_s)[:FIRST],
            "outcome": outcome,
        }


def _leaves(began: list[tuple[float, str]], since_s: float) -> list[str]:
    """Names of the leaves that began after a moment: what was done about it."""
    later = [path for stamp_s, path in began if stamp_s > since_s - 1e-9]
    return [p.rsplit("/", 1)[-1] for p in later if not any(q.startswith(p + "/") for q in later)]
