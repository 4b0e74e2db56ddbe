"""The section of injected faults: their effect, and who saw them."""

from __future__ import annotations

from typing import Any

from glotouch_bt.report.page import esc, number, section, table
from glotouch_bt.report.run_record import RunRecord


def faults_section(record: RunRecord) -> str:
    """Return one line per fault of the run's plan, or nothing without a plan."""
    faults = record.result.get("faults")
    if not isinstance(faults, list) or not faults:
        return ""
    rows = [_row(f) for f in faults]
    lead = (
        "These faults were injected on purpose. Altered counts the changes to the device's data and commands. Seen by "
        "names the first reaction after the first change."
    )
    head = ("fault", "began, s", "in", "altered", "seen by", "after", "then ran")
    return section("Injected faults", lead, table(head, rows, numeric_from=99))


def _row(fault: dict[str, Any]) -> tuple[str, ...]:
    counts = (
        ("samples_altered", "samples"),
        ("commands_altered", "commands"),
        ("commands_refused", "refused"),
        ("acts", "acts"),
    )
    changed = ", ".join(f"{fault[key]} {word}" for key, word in counts if fault.get(key)) or "nothing"
    if fault.get("moved_m"):
        changed += f", {number(fault['moved_m'], 1, 'mm', 1e3)}"
    seen = fault.get("seen") or {}
    nodes = sorted({str(n).rsplit("/", 1)[-1] for n in fault.get("nodes", ())})
    began = ", ".join(number(s, 2) for s in fault.get("begun_s", ())[:3])
    who = f"{seen.get('by', '')}: {seen.get('code', '')}".strip(": ") or "nobody"
    return (
        esc(fault["name"]),
        began or "never",
        esc(", ".join(nodes[:3])),
        esc(changed) if fault.get("effective") else f'<span class="chip warn">{esc(changed)}</span>',
        esc(who),
        number(fault.get("latency_s"), 2, "s"),
        esc(", ".join(fault.get("recovery", ())[:4])),
    )
