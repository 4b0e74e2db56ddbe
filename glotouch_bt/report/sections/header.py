"""The head of the report: verdict, facts and key numbers."""

from __future__ import annotations

import math
from typing import Any

from glotouch_bt.mission.record import OBJECTS_RESULT, objects_in_words
from glotouch_bt.report.page import esc, number
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.sections.force import tared_force
from glotouch_bt.report.sections.map import candidates
from glotouch_bt.report.sections.reasons import reason_chain


def parameter(record: RunRecord, name: str) -> Any:
    """Return a parameter of the mission, else the value of this name in the description of the run."""
    value = record.of_run("parameters", name)
    return record.run.get(name) if value is None else value


def header_section(record: RunRecord) -> str:
    """Return the verdict, the facts and the key numbers."""
    tone, sentence = verdict(record)
    r, run = record.result, record.run
    facts = []
    for name in ("mission", "target", "seed", "conditions", "backend", "robot"):
        value = r.get(name, run.get(name, parameter(record, name)))
        if name == "robot":
            value = record.of_run("robot", "description", "name")
        elif isinstance(value, dict):
            value = value.get("name")
        if value is not None:
            facts.append(f"<span>{name} <b>{esc(value)}</b></span>")
    if not record.complete:
        facts.append('<span class="chip warn">the record was cut short</span>')
    tiles = "".join(f'<div class="tile"><b>{v}</b><span>{esc(k)}</span></div>' for k, v in _numbers(record))
    over = esc(r.get("mission") or run.get("mission") or "run")
    return (
        f'<header class="{tone}"><p class="over">GLoTouch run report · {over}</p>'
        f'<h1 class="verdict">{esc(sentence)}</h1>{_description(record)}'
        f'<p class="facts">{"".join(facts)}</p>{_results(record)}<div class="tiles">{tiles}</div></header>'
    )


def _description(record: RunRecord) -> str:
    """Return what the mission is for, as its file says it."""
    text = record.of_run("description")
    return f'<p class="lead">{esc(text)}</p>' if isinstance(text, str) and text else ""


def _results(record: RunRecord) -> str:
    """Return the sizes of the objects, then the results that skills declare, in the order of their first writing."""
    found = {OBJECTS_RESULT: ""}
    found |= {str(e.data.get("key")): str(e.data.get("text") or "") for e in record.of_kind("result")}
    found[OBJECTS_RESULT] = objects_in_words(candidates(record)) or found[OBJECTS_RESULT]
    lines = "".join(f"<li>{esc(text)}</li>" for text in found.values() if text)
    return f'<ul class="results">{lines}</ul>' if lines else ""


def _numbers(record: RunRecord) -> list[tuple[str, str]]:
    """Return name and value of each known key number."""
    r = record.result
    start, end = record.span_s
    sim_s: Any = r.get("sim_time_s", end - start if end > start else None)
    wall_s: Any = r.get("wall_time_s")
    out = [("robot time", _clock(sim_s))]
    if _real(wall_s):
        out.append(("wall time", _clock(wall_s)))
        if _real(sim_s) and wall_s > 0:
            out.append(("real time", number(sim_s / wall_s, 1) + "×"))
    found = candidates(record)
    expected = parameter(record, "expected_objects")
    if found or isinstance(expected, int):
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
    felt = r.get("sensed_peak_force_N")
    if not _real(felt):
        felt = float(tared_force(record)[1].max(initial=0.0))
    out.append(("peak force felt at the wrist", number(felt, 1, "N") if felt else "not tared"))
    out.append(("true peak force (simulation)", number(r.get("true_peak_force_N"), 1, "N")))
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
    return f"{minutes}:{seconds:02d} min"


def verdict(record: RunRecord) -> tuple[str, str]:
    """Return (good | bad | warn, one sentence)."""
    r = record.result
    target = r.get("target") or parameter(record, "target") or "the target"
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
    last = reasons[-1] if reasons else {}
    root = last.get("message") or last.get("code") or ""
    if status == "failure":
        node = str(last.get("node") or "").rpartition("/")[2]
        return "bad", ": ".join(part for part in ("Failed", node, root) if part)
    if status == "aborted":
        return "warn", "Aborted" + (f": {root}" if root else "")
    return "warn", "The run did not end" if not record.complete else "The run has no result"
