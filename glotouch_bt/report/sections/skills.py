"""The sections that skills add to the report (`Skill.report`)."""

from __future__ import annotations

from typing import Any

from glotouch_bt.mission.record import short_text
from glotouch_bt.report.page import esc, section, table
from glotouch_bt.report.run_record import RunRecord


def skills_section(record: RunRecord) -> str:
    """Return one section for each title, as it was reported last; nothing if no skill reports."""
    found: dict[str, dict[str, Any]] = {str(e.data.get("title")): e.data for e in record.of_kind("report")}
    return "".join(section(title, esc(d.get("text") or ""), _table(d)) for title, d in found.items())


def _table(data: dict[str, Any]) -> str:
    rows = [[esc(short_text(cell)) for cell in row] for row in data.get("rows") or () if isinstance(row, list)]
    return table([esc(h) for h in data.get("head") or ()], rows) if rows else ""
