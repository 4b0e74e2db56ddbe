"""report.html of a run: its verdict and numbers first, then everything it felt, found and decided."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from glotouch_bt.report.depth import depth_section
from glotouch_bt.report.faults import faults_section
from glotouch_bt.report.force import force_section
from glotouch_bt.report.map import candidates, map_section
from glotouch_bt.report.page import esc, number, page, section, table
from glotouch_bt.report.ranking import ranking_section
from glotouch_bt.report.run_record import RunRecord, read_run
from glotouch_bt.report.timeline import timeline_section
from glotouch_bt.robot import BadInput

REPORT_NAME = "report.html"
_SHOWN_ELSEWHERE = {"contact", "candidate", "sweep", "touchset", "ranking"}
_LOG_LINES = 200


def write_report(run_dir: Path) -> Path:
    """Make report.html in a run's folder from run.mcap, result.json and, if present, truth.json.

    Parts the run never reached are left out. It is written whole, or the one before stays.

    Returns:
        The file written.

    Raises:
        BadInput: There is no record, or the folder cannot be written.
    """
    target, part = run_dir / REPORT_NAME, run_dir / f".{REPORT_NAME}.part"
    text = render(read_run(run_dir))
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(target)
    except OSError as e:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise BadInput(f"{target}: the report cannot be written ({e.strerror})") from e
    return target


def render(record: RunRecord) -> str:
    """The report's HTML."""
    parts = [_part(name, make, record) for name, make in PARTS]
    mission = record.result.get("mission") or record.run.get("mission") or "run"
    return page(f"{mission} · {verdict(record)[1]}", "".join(parts))


def _part(name: str, make: Callable[[RunRecord], str], record: RunRecord) -> str:
    """One part of the page; what cannot be read (an event of another version's shape) costs only that part."""
    try:
        return make(record)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as e:
        return section(name, f"This part of the record could not be read ({esc(type(e).__name__)}: {esc(e)}).", "")


def verdict(record: RunRecord) -> tuple[str, str]:
    """(good | bad | warn, one sentence)."""
    r = record.result
    target = r.get("target") or _parameter(record, "target") or "the target"
    status = r.get("status")
    if status == "success":
        if r.get("correct") is False:
            return "bad", f"Lifted the wrong object, not {target}"
        if r.get("retrieved") is False:
            return "bad", "The mission ended well, but nothing is in the gripper"
        if r.get("retrieved"):
            return "good", f"Retrieved {target}"
        return "good", "The mission succeeded"
    reasons = reason_chain(record)
    root = (reasons[-1].get("message") or reasons[-1].get("code") or "") if reasons else ""
    if status == "failure":
        return "bad", "Failed" + (f": {root}" if root else "")
    if status == "aborted":
        return "warn", "Aborted" + (f": {root}" if root else "")
    return "warn", "The run did not end" if not record.complete else "The run has no result"


def reason_chain(record: RunRecord) -> list[dict[str, Any]]:
    """Why the run ended as it did, outermost first: {code, message, evidence, advice, node} each, as far as known."""
    for key in ("reason_chain", "reasons", "reason"):
        value = record.result.get(key)
        if value:
            items = value if isinstance(value, list) else [value]
            return [i if isinstance(i, dict) else {"message": str(i)} for i in items]
    return []


def _parameter(record: RunRecord, name: str) -> Any:
    value = record.of_run("parameters", name)
    return record.run.get(name) if value is None else value


def _header(record: RunRecord) -> str:
    tone, sentence = verdict(record)
    r, run = record.result, record.run
    facts = []
    for name in ("mission", "target", "seed", "conditions", "backend"):
        value = r.get(name, run.get(name, _parameter(record, name)))
        if isinstance(value, dict):
            value = value.get("name")
        if value is not None:
            facts.append(f"<span>{name} <b>{esc(value)}</b></span>")
    if not record.complete:
        facts.append('<span class="chip warn">the record was cut short</span>')
    tiles = "".join(f'<div class="tile"><b>{v}</b><span>{esc(k)}</span></div>' for k, v in _numbers(record))
    over = esc(r.get("mission") or run.get("mission") or "run")
    return (
        f'<header class="{tone}"><p class="over">GLoTouch run report · {over}</p>'
        f'<h1 class="verdict">{esc(sentence)}</h1>'
        f'<p class="facts">{"".join(facts)}</p><div class="tiles">{tiles}</div></header>'
    )


def _numbers(record: RunRecord) -> list[tuple[str, str]]:
    """The key numbers, those that are known."""
    r = record.result
    start, end = record.span_s
    sim_s: Any = r.get("sim_time_s", end - start if end > start else None)
    wall_s: Any = r.get("wall_time_s")
    out = [("robot time", _clock(sim_s))]
    if _real(wall_s):
        out.append(("wall time", _clock(wall_s)))
        if _real(sim_s) and wall_s > 0:
            out.append(("times real time", number(sim_s / wall_s, 1) + "×"))
    found = candidates(record)
    expected = _parameter(record, "expected_objects")
    out.append(("objects found", f"{len(found)}" + (f" of {esc(expected)}" if isinstance(expected, int) else "")))
    contacts = len(record.of_kind("contact"))
    if contacts:
        out.append(("contacts", str(contacts)))
    touchsets = [e.data.get("touchset") for e in record.of_kind("touchset")]
    closures = sum(
        len(s.get("layers") or []) for t in touchsets if isinstance(t, dict) for s in t.get("sequences") or []
    )
    if closures:
        out.append(("jaw closures", str(closures)))
    peak = r.get("peak_force_N")
    if not _real(peak) and len(record.samples.get("stamp_s", ())):
        peak = float(np.nan_to_num(np.linalg.norm(record.samples["force_S_N"], axis=1)).max())
    out.append(("peak force", number(peak, 1, "N")))
    if _real(r.get("probe_path_m")):
        out.append(("probe path", number(r["probe_path_m"], 2, "m")))
    return [(k, v) for k, v in out if v != "–"]


def _real(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _clock(value: Any) -> str:
    if not _real(value):
        return "–"
    if value < 120:
        return number(value, 1, "s")
    minutes, seconds = divmod(round(value), 60)
    return f"{minutes} min {seconds:02d} s"


def _reasons(record: RunRecord) -> str:
    chain = reason_chain(record)
    if not chain:
        return ""
    items = []
    for reason in chain:
        node = f"<code>{esc(reason['node'])}</code> " if reason.get("node") else ""
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
    return section("Why", lead, f'<ol class="chain">{"".join(items)}</ol>')


def _log(record: RunRecord) -> str:
    """Notes and small events in the order of time."""
    rows = []
    for e in record.events:
        if e.kind in _SHOWN_ELSEWHERE:
            continue
        data = {k: v for k, v in e.data.items() if k not in ("node", "text")}
        text = esc(e.data.get("text", ""))
        pairs = ", ".join(f"{esc(k)} = {esc(_short(v))}" for k, v in data.items())
        rows.append(
            [number(e.stamp_s, 2), esc(e.kind), esc(e.data.get("node", "")), "; ".join(p for p in (text, pairs) if p)]
        )
    if not rows:
        return ""
    cut = f"<p>The first {_LOG_LINES} of {len(rows)} lines.</p>" if len(rows) > _LOG_LINES else ""
    body = table(["s", "what", "node", ""], rows[:_LOG_LINES], numeric_from=9) + cut
    return section("Log", "What the skills noted on the way, besides contacts and squeezes.", body)


def _short(value: Any) -> str:
    """A value in a line: numbers to four digits, lists and objects one level deep."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return "[" + ", ".join(_short(v) for v in value[:8]) + (", …]" if len(value) > 8 else "]")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {_short(v)}" for k, v in list(value.items())[:10]) + "}"
    return str(value)


def _about(record: RunRecord) -> str:
    """The run's description, for whoever wants to repeat it."""
    rows = []
    for source in (record.run, {"versions": record.result.get("versions")}):
        for key, value in source.items():
            if value is not None:
                rows.append([f"<code>{esc(key)}</code>", esc(_short(value))])
    count = len(record.samples.get("stamp_s", ()))
    rows.append(["<code>record</code>", f"{esc(record.path.name)}, {count} force samples, {len(record.events)} events"])
    body = f"<details><summary>Show</summary>{table(['name', 'value'], rows, numeric_from=9)}</details>"
    return section("About this run", "What the run was told before it began.", body)


PARTS: tuple[tuple[str, Callable[[RunRecord], str]], ...] = (
    ("Verdict", _header),
    ("Why", _reasons),
    ("Injected faults", faults_section),
    ("Map", map_section),
    ("Force", force_section),
    ("Squeezes", depth_section),
    ("Recognition", ranking_section),
    ("Timeline of the tree", timeline_section),
    ("Log", _log),
    ("About this run", _about),
)
