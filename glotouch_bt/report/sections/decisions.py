"""The section of the scheduled touches: which touch came next, why, and how probable each candidate was."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from glotouch_bt.report.page import esc, number, section, table
from glotouch_bt.report.run_record import RecordedEvent, RunRecord

MIN_SHOWN = 0.005
"""Probabilities below this are shown as a dot."""


def decisions_section(record: RunRecord) -> str:
    """Return one row for each decision of `next_probe` and `touch_next`, or nothing."""
    events = record.of_kind("next_probe", "closure", "decided")
    if not events:
        return ""
    indices = sorted({i for e in events for i in _shares(e)[0]}, key=lambda i: (len(i), i))
    rows = []
    for e in events:
        shares, absent = _shares(e)
        rows.append(
            [number(e.stamp_s, 1), *_what(e.data), *(_share(shares.get(i)) for i in indices), _share(absent)],
        )
    head = ["t, s", "next touch", "why", "gain, nats", "time, s", *(f"P({esc(i)})" for i in indices), "P(none)"]
    lead = (
        "Every touch is the one with the most expected information gain per second. P: the probability, before this "
        "touch, that a candidate, or none, is the target. A candidate that the STL excludes is left out, unless the "
        "decision fails."
    )
    return section("Decisions", lead, table(head, rows, numeric_from=3))


def _what(data: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Return the touch, the reason, its gain and its duration."""
    chosen, touch = data.get("chosen"), data.get("touch")
    why, seconds = esc(data.get("why") or ""), number(data.get("seconds"), 0)
    if isinstance(chosen, dict):
        height = number(chosen.get("height_m"), 0, "mm", 1e3)
        what = f"jaws on candidate {esc(chosen.get('candidate'))} at {height}"
        return what, "most expected gain per second", number(chosen.get("gain_nats"), 2), seconds
    if isinstance(touch, dict):
        what = f"{esc(touch.get('part'))} of candidate {esc(touch.get('candidate'))}"
        return what, why, number(touch.get("gain_nats"), 2), seconds
    return "no further touch", why, "–", "–"


def _shares(event: RecordedEvent) -> tuple[dict[str, float], float]:
    """Return the probability of each candidate, by index, and of none."""
    ranking = event.data.get("ranking")
    if isinstance(ranking, dict):
        found = {str(m.get("index")): m.get("probability") for m in ranking.get("matches") or []}
        absent = ranking.get("p_absent")
    else:
        probability = event.data.get("probability")
        found = {str(i): p for i, p in (probability if isinstance(probability, dict) else {}).items()}
        absent = event.data.get("p_absent")
    return {i: _finite(p) for i, p in found.items()}, _finite(absent)


def _finite(value: Any) -> float:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else math.nan


def _share(value: float | None) -> str:
    if value is None or not math.isfinite(value):
        return "–"
    return "·" if value < MIN_SHOWN else number(value, 2)
