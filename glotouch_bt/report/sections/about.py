"""The section with the configuration of a run."""

from __future__ import annotations

from glotouch_bt.mission.record import short_text
from glotouch_bt.report.page import esc, section, table
from glotouch_bt.report.run_record import RunRecord


def about_section(record: RunRecord) -> str:
    """Return the run's description and versions."""
    rows = []
    for source in (record.run, {"versions": record.result.get("versions")}):
        for key, value in source.items():
            if value is not None:
                rows.append([f"<code>{esc(key)}</code>", esc(short_text(value))])
    count = len(record.samples.get("stamp_s", ()))
    rows.append(["<code>record</code>", f"{esc(record.path.name)}, {count} force samples, {len(record.events)} events"])
    body = f"<details><summary>Show</summary>{table(['name', 'value'], rows, numeric_from=9)}</details>"
    return section("About this run", "The configuration of the run.", body)
