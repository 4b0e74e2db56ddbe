"""What a run has found so far: counts for the progress line, and the decisions that go into result.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from glotouch_bt.mission.record import Json, to_json
from glotouch_bt.robot import Array, Command, Observation


class Record(Protocol):
    """What the runner writes to; `mission.record.Recorder` is one."""

    def block(self, observation: Observation, command: Command) -> None:
        """One control cycle."""
        ...

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Nodes whose status changed: (path, old, new)."""
        ...

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """What a skill found or decided."""
        ...

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """A blackboard write."""
        ...


class NullRecord:
    """Records nothing."""

    def block(self, observation: Observation, command: Command) -> None:
        """Nothing."""

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Nothing."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Nothing."""

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Nothing."""


_NOT_COUNTED = ("_record", "_pending")


class RunSummary:
    """A record that passes everything on and keeps count.

    Attributes:
        contacts: Contact events so far.
        candidates: Data of each candidate event, without its contacts.
        ranking: Data of the last ranking event, or None.
        last_event: (robot time, kind) of the last event.
        node: Path of the last leaf that began.
        peak_force_N: Largest norm of the sensed wrist force.
        probe_path_m: Way of P while the probe was in the jaws (between `tool` events).
    """

    def __init__(self, record: Record) -> None:
        self._record = record
        self.contacts = 0
        self.candidates: list[Json] = []
        self.ranking: Json = None
        self.last_event: tuple[float, str] = (0.0, "")
        self.node = ""
        self.peak_force_N = 0.0
        self.probe_path_m = 0.0
        self._probe_held = False
        self._last_P_m: Array | None = None
        self._pending: list[Observation] = []

    def block(self, observation: Observation, command: Command) -> None:
        """Pass on, and measure (in batches: this is called every cycle)."""
        self._record.block(observation, command)
        self._pending.append(observation)
        if len(self._pending) >= 200:
            self.settle()

    def settle(self) -> None:
        """Bring the measured quantities up to date."""
        if not self._pending:
            return
        blocks, self._pending = self._pending, []
        force = np.concatenate([b.wrench_S[:, :3] for b in blocks])
        self.peak_force_N = max(self.peak_force_N, float(np.sqrt((force * force).sum(axis=1).max())))
        track = np.stack([b.position_B_P[-1] for b in blocks])
        if self._probe_held:
            start = track[:1] if self._last_P_m is None else self._last_P_m[None]
            steps = np.diff(np.concatenate([start, track]), axis=0)
            self.probe_path_m += float(np.sqrt((steps * steps).sum(axis=1)).sum())
        self._last_P_m = track[-1]

    def state(self) -> dict[str, Any]:
        """All that was counted, for a checkpoint; settled."""
        self.settle()
        return {name: value for name, value in vars(self).items() if name not in _NOT_COUNTED}

    def take_up(self, state: Mapping[str, Any]) -> None:
        """Go on counting from a `state`."""
        vars(self).update({name: value for name, value in state.items() if name in vars(self)})

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Pass on."""
        self._record.tick(stamp_s, changes)

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Pass on."""
        self._record.port(stamp_s, key, value)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Pass on, and keep what the result needs."""
        self._record.event(kind, stamp_s, data)
        self.last_event = (stamp_s, kind)
        if kind == "contact":
            self.contacts += 1
        elif kind == "candidate":
            self._keep(_candidate(to_json(data.get("candidate", data))))
        elif kind == "ranking":
            self.ranking = to_json(data.get("ranking", data), summarise=True)
        elif kind == "tool":
            self.settle()
            self._probe_held = bool(data.get("held", False))

    def _keep(self, candidate: Json) -> None:
        """A candidate that comes again, measured better, replaces what was known of it."""
        index = candidate.get("index") if isinstance(candidate, dict) else None
        for i, known in enumerate(self.candidates):
            if index is not None and isinstance(known, dict) and known.get("index") == index:
                self.candidates[i] = candidate
                return
        self.candidates.append(candidate)


def _candidate(data: Json) -> Json:
    """A candidate without its raw contacts and residuals (they are in the record)."""
    if not isinstance(data, dict):
        return data
    kept: dict[str, Json] = {k: v for k, v in data.items() if k not in ("contacts", "node")}
    contour = kept.get("contour")
    if isinstance(contour, dict):
        kept["contour"] = {k: v for k, v in contour.items() if k != "residuals_m"}
    if isinstance(data.get("contacts"), list):
        kept["contacts"] = len(data["contacts"])  # type: ignore[arg-type]
    return kept
