"""Compare the events and status changes of a run with those of its replay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from glotouch_bt.report import RecordedEvent


@dataclass(frozen=True)
class ReplayDifference:
    """One difference between a run and its replay.

    Attributes:
        stamp_s: Robot clock.
        kind: Kind of event, or ``tick``.
        where: Number of the event of its kind, and the path to the value in it.
        then, now: Values in the run and in the replay; None if missing.
    """

    stamp_s: float
    kind: str
    where: str
    then: Any
    now: Any

    def __str__(self) -> str:
        return f"t={self.stamp_s:.2f} s {self.kind} {self.where}: {_short(self.then)} then, {_short(self.now)} now"


def compare_events(
    then: Sequence[RecordedEvent], now: Sequence[RecordedEvent], tolerance: float
) -> tuple[list[ReplayDifference], dict[str, int], dict[str, tuple[float, str]]]:
    """Return the differences of events, the number compared, and the largest numeric difference, by kind.

    At most one difference per event is listed: the first value that differs.
    """
    differences: list[ReplayDifference] = []
    compared: dict[str, int] = {}
    largest: dict[str, tuple[float, str]] = {}
    for kind in dict.fromkeys(e.kind for e in (*then, *now)):
        old, new = ([e for e in events if e.kind == kind] for events in (then, now))
        compared[kind] = min(len(old), len(new))
        worst = (0.0, "")
        for i, (a, b) in enumerate(zip(old, new, strict=False)):
            comparison = _Comparison(tolerance)
            comparison.values(a.data, b.data, "")
            if comparison.largest[0] > worst[0]:
                worst = (comparison.largest[0], f"{i + 1}{comparison.largest[1]}")
            if comparison.first is not None:
                path, was, is_ = comparison.first
                differences.append(ReplayDifference(a.stamp_s, kind, f"{i + 1}{path}", was, is_))
        largest[kind] = worst
        for i, e in enumerate(old[len(new) :], start=len(new) + 1):
            differences.append(ReplayDifference(e.stamp_s, kind, f"{i}", e.data.get("node", "there"), None))
        for i, e in enumerate(new[len(old) :], start=len(old) + 1):
            differences.append(ReplayDifference(e.stamp_s, kind, f"{i}", None, e.data.get("node", "there")))
    return differences, compared, largest


def compare_ticks(
    then: Sequence[tuple[float, str, str]], now: Sequence[tuple[float, str, str]]
) -> list[ReplayDifference]:
    """Return the first status change that differs, as a list of at most one difference."""
    for (stamp_s, node, state), (_, node_now, state_now) in zip(then, now, strict=False):
        if (node, state) != (node_now, state_now):
            return [ReplayDifference(stamp_s, "tick", "", f"{node} {state}", f"{node_now} {state_now}")]
    return []


class _Comparison:
    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self.first: tuple[str, Any, Any] | None = None
        self.largest = (0.0, "")

    def values(self, a: Any, b: Any, path: str) -> None:
        """Compare two JSON values recursively."""
        if isinstance(a, dict) and isinstance(b, dict):
            for key in dict.fromkeys((*a, *b)):
                self.values(a.get(key), b.get(key), f"{path}.{key}")
        elif isinstance(a, list) and isinstance(b, list):
            if len(a) != len(b):
                self._differ(path, f"{len(a)} items", f"{len(b)} items")
            for i, (x, y) in enumerate(zip(a, b, strict=False)):
                self.values(x, y, f"{path}[{i}]")
        elif _number(a) and _number(b):
            error = abs(a - b)
            if error > self.largest[0]:
                self.largest = (error, path)
            if error > self._tolerance * max(1.0, abs(a)):
                self._differ(path, a, b)
        elif a != b:
            self._differ(path, a, b)

    def _differ(self, path: str, a: Any, b: Any) -> None:
        if self.first is None:
            self.first = (path, a, b)


def _number(x: Any) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool)


def _short(value: Any) -> str:
    if value is None:
        return "nothing"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
