"""What differs between what a run found and what its replay finds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from glotouch_bt.report import Event


@dataclass(frozen=True)
class Difference:
    """One thing that is not the same.

    Attributes:
        stamp_s: Robot clock.
        kind: Kind of event, or ``tick``.
        where: Which one, and the path to the value in it.
        then, now: Values in the run and in the replay; None: not there.
    """

    stamp_s: float
    kind: str
    where: str
    then: Any
    now: Any

    def __str__(self) -> str:
        return f"t={self.stamp_s:.2f} s {self.kind} {self.where}: {_short(self.then)} then, {_short(self.now)} now"


def compare_events(
    then: Sequence[Event], now: Sequence[Event], tolerance: float
) -> tuple[list[Difference], dict[str, int], dict[str, tuple[float, str]]]:
    """Differences of events, kind by kind in their order; how many were compared; the largest difference of a number.

    One difference an event is given: the first value, in the event's own order, that is not the same.
    """
    differences: list[Difference] = []
    compared: dict[str, int] = {}
    largest: dict[str, tuple[float, str]] = {}
    for kind in dict.fromkeys(e.kind for e in (*then, *now)):
        old, new = ([e for e in events if e.kind == kind] for events in (then, now))
        compared[kind] = min(len(old), len(new))
        worst = (0.0, "")
        for i, (a, b) in enumerate(zip(old, new, strict=False)):
            found = _Compared(tolerance)
            found.values(a.data, b.data, "")
            if found.largest[0] > worst[0]:
                worst = (found.largest[0], f"{i + 1}{found.largest[1]}")
            if found.first is not None:
                path, was, is_ = found.first
                differences.append(Difference(a.stamp_s, kind, f"{i + 1}{path}", was, is_))
        largest[kind] = worst
        for i, e in enumerate(old[len(new) :], start=len(new) + 1):
            differences.append(Difference(e.stamp_s, kind, f"{i}", e.data.get("node", "there"), None))
        for i, e in enumerate(new[len(old) :], start=len(old) + 1):
            differences.append(Difference(e.stamp_s, kind, f"{i}", None, e.data.get("node", "there")))
    return differences, compared, largest


def compare_ticks(then: Sequence[tuple[float, str, str]], now: Sequence[tuple[float, str, str]]) -> list[Difference]:
    """The first node that changed its status otherwise; what follows from it is not listed."""
    for (stamp_s, node, state), (_, node_now, state_now) in zip(then, now, strict=False):
        if (node, state) != (node_now, state_now):
            return [Difference(stamp_s, "tick", "", f"{node} {state}", f"{node_now} {state_now}")]
    return []


class _Compared:
    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self.first: tuple[str, Any, Any] | None = None
        self.largest = (0.0, "")

    def values(self, a: Any, b: Any, path: str) -> None:
        """Compare two values of JSON, deeply."""
        if isinstance(a, dict) and isinstance(b, dict):
            for key in dict.fromkeys((*a, *b)):
                self.values(a.get(key), b.get(key), f"{path}.{key}")
        elif isinstance(a, list) and isinstance(b, list):
            if len(a) != len(b):
                self._differ(path, f"{len(a)} items", f"{len(b)} items")
            for i, (x, y) in enumerate(zip(a, b, strict=False)):
                self.values(x, y, f"{path}[{i}]")
        elif _number(a) and _number(b):
            off = abs(a - b)
            if off > self.largest[0]:
                self.largest = (off, path)
            if off > self._tolerance * max(1.0, abs(a)):
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
