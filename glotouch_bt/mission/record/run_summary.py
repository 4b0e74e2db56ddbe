"""Summarise a run while it is recorded: counts for the progress line, and decisions for result.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from glotouch_bt.mission.record import OBJECTS_RESULT, Json, objects_in_words, to_json
from glotouch_bt.mission.record.recorded_requests import REQUEST, REQUEST_DONE
from glotouch_bt.robot import Array, Command, Observation, Tare
from glotouch_bt.untrusted import require_type


class Record(Protocol):
    """Receiver of everything the runner records, for example `Recorder`."""

    def block(self, observation: Observation, command: Command) -> None:
        """Record one control cycle."""

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Record nodes whose status changed: (path, old, new)."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Record an event of a skill."""

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Record a blackboard write."""


class NullRecord:
    """A record that drops everything."""

    def block(self, observation: Observation, command: Command) -> None:
        """Drop it."""

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Drop it."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Drop it."""

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Drop it."""


_NOT_SAVED = ("_record", "_pending")
CALIBRATED = ("tip_P_m", "tip_sd_m", "latency_s", "compliance_P_m_N")
"""Keys of a calibration that the result repeats."""
BATCH = 200
"""Control cycles measured at a time."""


class RunSummary:
    """A record that forwards everything and keeps counts.

    Attributes:
        contacts: Contact events so far.
        candidates: Data of each candidate, without its contacts.
        ranking: Data of the last ranking event, or None.
        calibration: Data of the last calibration of the probe, or None.
        best: The candidate with the highest probability and that probability; (-1, 0) before the first decision.
        results: Results of the run by key, each {text, node}, the latest of its key: the sizes of the candidates,
            then the outputs that skills declare as results.
        last_event: (robot time, kind) of the last event.
        node: Path of the last leaf that started.
        skill: Name of its skill; empty for another node.
        skill_cycles: Control cycles by skill.
        peak_force_N: Largest norm of the sensed wrist force since the first tare; before it, the sensor reads the
            hand's weight.
        probe_path_m: Length of the path of P while the probe was in the jaws (between `tool` events).
    """

    def __init__(self, record: Record) -> None:
        self._record = record
        self.contacts = 0
        self.candidates: list[Json] = []
        self.ranking: Json = None
        self.calibration: Json = None
        self.best: tuple[int, float] = (-1, 0.0)
        self.results: dict[str, Json] = {}
        self.last_event: tuple[float, str] = (0.0, "")
        self.node = self.skill = ""
        self.skill_cycles: dict[str, int] = {}
        self.peak_force_N = 0.0
        self._tares: list[int] = []
        self._tared = False
        self.probe_path_m = 0.0
        self._probe_held = False
        self._last_P_m: Array | None = None
        self._pending: list[Observation] = []

    def block(self, observation: Observation, command: Command) -> None:
        """Forward and measure, in batches."""
        self._record.block(observation, command)
        self._pending.append(observation)
        self.skill_cycles[self.skill] = self.skill_cycles.get(self.skill, 0) + 1
        if len(self._pending) >= BATCH:
            self.flush()

    def flush(self) -> None:
        """Update the measured quantities."""
        if not self._pending:
            return
        blocks, self._pending = self._pending, []
        if self._tared:
            force = np.concatenate([b.wrench_S[:, :3] for b in blocks])
            self.peak_force_N = max(self.peak_force_N, float(np.sqrt((force * force).sum(axis=1).max())))
        track = np.stack([b.position_B_P[-1] for b in blocks])
        if self._probe_held:
            start = track[:1] if self._last_P_m is None else self._last_P_m[None]
            steps = np.diff(np.concatenate([start, track]), axis=0)
            self.probe_path_m += float(np.sqrt((steps * steps).sum(axis=1)).sum())
        self._last_P_m = track[-1]

    def state(self) -> dict[str, Any]:
        """Return everything counted, for a checkpoint."""
        self.flush()
        return {name: value for name, value in vars(self).items() if name not in _NOT_SAVED}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a `state`.

        Raises:
            BadInput: A value is of another type.
        """
        for name, value in state.items():
            if name in vars(self) and name not in ("ranking", "calibration", "_last_P_m"):
                require_type(value, type(vars(self)[name]), f"summary.{name}")
        vars(self).update({name: value for name, value in state.items() if name in vars(self)})

    def tick(self, stamp_s: float, changes: Sequence[tuple[str, object, object]]) -> None:
        """Forward."""
        self._record.tick(stamp_s, changes)

    def port(self, stamp_s: float, key: str, value: object) -> None:
        """Forward."""
        self._record.port(stamp_s, key, value)

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Forward, and store what the result needs."""
        self._record.event(kind, stamp_s, data)
        self.last_event = (stamp_s, kind)
        shares = data.get("probability")
        if isinstance(shares, Mapping) and shares:
            self.best = max(((int(i), float(p)) for i, p in shares.items()), key=lambda share: share[1])
        if kind == "contact":
            self.contacts += 1
        elif kind == "candidate":
            self._store(_candidate(to_json(data.get("candidate", data))), str(data.get("node", "")))
        elif kind == "forgotten":
            gone = to_json(data.get("candidates", ()))
            self.candidates = [c for c in self.candidates if not isinstance(gone, list) or _index(c) not in gone]
        elif kind == "ranking":
            self.ranking = to_json(data.get("ranking", data), summarise=True)
        elif kind == "result":
            self.results[str(data["key"])] = to_json({k: v for k, v in data.items() if k != "key"})
        elif kind == "calibration":
            self.calibration = to_json({k: v for k, v in data.items() if k in CALIBRATED})
        elif kind == REQUEST and data.get("request") == Tare.__name__:
            self._tares.append(int(str(data["number"])))
        elif kind == REQUEST_DONE and not self._tared and data.get("number") in self._tares and not data.get("error"):
            self.flush()
            self._tared = True
        elif kind == "tool":
            self.flush()
            self._probe_held = bool(data.get("held", False))

    def _store(self, candidate: Json, node: str) -> None:
        """Store a candidate; a candidate measured again replaces its earlier entry."""
        index = _index(candidate)
        known = [_index(c) for c in self.candidates]
        at = known.index(index) if index is not None and index in known else len(known)
        self.candidates[at : at + 1] = [candidate]
        if text := objects_in_words(self.candidates):
            others = {key: result for key, result in self.results.items() if key != OBJECTS_RESULT}
            self.results = {OBJECTS_RESULT: {"node": node, "text": text}, **others}


def _index(candidate: Json) -> Json:
    """Return the index of a candidate, or None if it has another shape."""
    return candidate.get("index") if isinstance(candidate, dict) else None


def _candidate(data: Json) -> Json:
    """Return a candidate without its raw contacts and residuals, which the record holds."""
    if not isinstance(data, dict):
        return data
    short: dict[str, Json] = {k: v for k, v in data.items() if k not in ("contacts", "node")}
    contour = short.get("contour")
    if isinstance(contour, dict):
        short["contour"] = {k: v for k, v in contour.items() if k != "residuals_m"}
    if isinstance(data.get("contacts"), list):
        short["contacts"] = len(data["contacts"])  # type: ignore[arg-type]
    return short
