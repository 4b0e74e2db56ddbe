"""The section with the notes and small events of a run."""

from __future__ import annotations

from glotouch_bt.mission.record import short_text
from glotouch_bt.report.page import esc, number, section, table
from glotouch_bt.report.run_record import RunRecord

_SHOWN_ELSEWHERE = {"result", "report", "contact", "candidate", "sweep", "touchset", "ranking"}
MAX_LINES = 200
"""Lines shown."""


def log_section(record: RunRecord) -> str:
    """Return notes and small events in order of time, or nothing."""
    rows = []
    for e in record.events:
        if e.kind in _SHOWN_ELSEWHERE:
            continue
        data = {k: v for k, v in e.data.items() if k not in ("node", "text")}
        text = esc(e.data.get("text", ""))
        pairs = ", ".join(f"{esc(k)} = {esc(short_text(v))}" for k, v in data.items())
        rows.append(
            [number(e.stamp_s, 2), esc(e.kind), esc(e.data.get("node", "")), "; ".join(p for p in (text, pairs) if p)]
        )
    if not rows:
        return ""
    cut = f"<p>The first {MAX_LINES} of {len(rows)} lines.</p>" if len(rows) > MAX_LINES else ""
    body = table(["s", "what", "node", ""], rows[:MAX_LINES], numeric_from=9) + cut
    return section("Log", "Notes and events of the skills, without contacts and squeezes.", body)
