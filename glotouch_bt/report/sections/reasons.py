"""The section with the reasons of a run that did not succeed."""

from __future__ import annotations

from typing import Any

from glotouch_bt.report.page import esc, section
from glotouch_bt.report.run_record import RunRecord


def reason_chain(record: RunRecord) -> list[dict[str, Any]]:
    """Return why the run ended, root cause last: {code, message, evidence, advice, node} each, as far as known."""
    for key in ("reason_chain", "reasons", "reason"):
        value = record.result.get(key)
        if value:
            items = value if isinstance(value, list) else [value]
            return [i if isinstance(i, dict) else {"message": str(i)} for i in items]
    return []


def reasons_section(record: RunRecord) -> str:
    """Return the chain of reasons, or nothing if the run has none."""
    chain = reason_chain(record)
    if not chain:
        return ""
    items = []
    for reason in chain:
        path = str(reason.get("node") or "")
        node = f'<code title="{esc(path)}">{esc(path.rsplit("/", 1)[-1])}</code> ' if path else ""
        code = f'<span class="chip idle">{esc(reason["code"])}</span> ' if reason.get("code") else ""
        found = reason.get("evidence")
        evidence = ", ".join(
            f"{esc(k)} = {esc(f'{v:.4g}' if isinstance(v, float) else v)}"
            for k, v in (found.items() if isinstance(found, dict) else ())
        )
        advice = f"Try: {esc(reason['advice'])}" if reason.get("advice") else ""
        more = "".join(f"<p>{part}</p>" for part in (evidence, advice) if part)
        items.append(f"<li>{code}{node}{esc(reason.get('message') or '')}{more}</li>")
    lead = "From what the mission as a whole reports down to the root cause."
    result = record.result
    notes = [f"Not scored: {esc(result['unscored'])}"] if result.get("unscored") else []
    notes += [f"To go on: <code>{esc(result['go_on'])}</code>"] if result.get("go_on") else []
    more = "".join(f"<p>{note}</p>" for note in notes)
    return section("Why", lead, f'<ol class="chain">{"".join(items)}</ol>{more}')
