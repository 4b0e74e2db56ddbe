"""The section with the notes and small events of a run."""

from __future__ import annotations

from glotouch_bt.mission.record import fields_in_words
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
        words = "; ".join(part for part in (str(e.data.get("text") or ""), fields_in_words(e.data)) if part)
        rows.append([number(e.stamp_s, 2), esc(e.kind), esc(e.data.get("node", "")), esc(words)])
    if not rows:
        return ""
    cut = f"<p>The first {MAX_LINES} of {len(rows)} lines.</p>" if len(rows) > MAX_LINES else ""
    body = table(["s", "what", "node", ""], rows[:MAX_LINES], numeric_from=9) + cut
    return section("Log", "Notes and events of the skills, without contacts and squeezes.", body)
