"""The decision: every candidate's loss against the target, what it is made of, and the gates."""

from __future__ import annotations

import math
from typing import Any

from glotouch_bt.report.page import esc, legend, number, section, table
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.svg import Scale, label, picture, x_axis

COLOURS = 6


def ranking_section(record: RunRecord) -> str:
    """The last ranking made, or nothing."""
    events = record.of_kind("ranking")
    if not events:
        return ""
    data = events[-1].data
    ranking = data["ranking"] if isinstance(data.get("ranking"), dict) else data
    matches = [m for m in ranking.get("matches") or [] if isinstance(m, dict)]
    matches.sort(key=lambda m: (_loss(m), str(m.get("index"))))
    target = data.get("target") or record.result.get("target") or "the target"
    lead = (
        f"How badly each candidate fits {esc(target)}: the loss, least first. The best is taken only if it leads "
        "clearly (margin), fits well (loss) and was felt enough (evidence)."
    )
    names = sorted({n for m in matches for n in (m.get("terms") or {})})
    body = (
        _gates(ranking, data, matches) + _bars(matches, names) + _table(matches, names, bool(ranking.get("accepted")))
    )
    return section("Recognition", lead, body)


def _loss(match: dict[str, Any]) -> float:
    value = match.get("loss")
    return float(value) if isinstance(value, int | float) else math.inf


def _gates(ranking: dict[str, Any], data: dict[str, Any], matches: list[dict[str, Any]]) -> str:
    accepted = bool(ranking.get("accepted"))
    chip = '<span class="chip good">accepted</span>' if accepted else '<span class="chip bad">not accepted</span>'
    found = data.get("gates") or ranking.get("gates")
    gates: dict[str, Any] = found if isinstance(found, dict) else {}
    best = matches[0] if matches else {}
    rows = []
    for name, value, limit, sense in (
        ("margin to the second", ranking.get("margin"), gates.get("margin"), "≥"),
        ("loss of the best", best.get("loss"), gates.get("loss"), "≤"),
        ("evidence of the best", best.get("evidence"), gates.get("evidence"), "≥"),
    ):
        verdict = ""
        if isinstance(value, int | float) and isinstance(limit, int | float):
            passed = value >= limit if sense == "≥" else value <= limit
            verdict = f'<span class="chip {"good" if passed else "bad"}">{"passed" if passed else "failed"}</span>'
        shown = number(value, 3)
        if name.startswith("margin") and value is None and len(matches) == 1:
            shown = "no second"
        need = f"{sense} {number(limit, 3)}" if isinstance(limit, int | float) else "–"
        rows.append([name, shown, need, verdict or "–"])
    reasons = "".join(f"<li>{esc(r)}</li>" for r in ranking.get("reasons") or [])
    return f"<p>{chip}</p>" + table(["gate", "found", "needed", ""], rows) + (f"<ul>{reasons}</ul>" if reasons else "")


def _bars(matches: list[dict[str, Any]], names: list[str]) -> str:
    """One bar a candidate, split into the terms where they add up to the loss."""
    finite = [m for m in matches if math.isfinite(_loss(m))]
    if not finite:
        return ""
    width, left, right, row, top = 1060.0, 110.0, 980.0, 30.0, 14.0
    bottom = top + row * len(matches)
    x = Scale(0.0, max(max(_loss(m) for m in finite), 1e-9) * 1.02, left, right)
    out = [x_axis(x, top - 6, bottom, "loss", about=8)]
    split = all(_adds_up(m) for m in finite)
    for i, m in enumerate(matches):
        y = top + row * i
        out.append(
            label(left - 12, y + 16, f"candidate {esc(m.get('index', '?'))}", "ink e" + (" b" if i == 0 else ""))
        )
        if not math.isfinite(_loss(m)):
            out.append(label(left + 6, y + 16, "nothing was felt"))
            continue
        at = left
        parts = [(n, float(m["terms"].get(n) or 0.0)) for n in names] if split and names else [("loss", _loss(m))]
        for k, (name, value) in enumerate(parts):
            w = x.at(value) - left
            if w > 0.05:
                out.append(
                    f'<rect x="{at:.1f}" y="{y + 3:.1f}" width="{w:.1f}" height="18" fill="var(--t{k % COLOURS})" '
                    f'stroke="var(--card)"><title>{esc(name)}: {value:.4f}</title></rect>'
                )
            at += max(w, 0.0)
        out.append(label(x.at(_loss(m)) + 8, y + 16, number(_loss(m), 3), "ink b"))
    keys = [(f"k-t{k % COLOURS}", esc(n)) for k, n in enumerate(names)] if split and names else []
    chart = picture(width, bottom + 38, "".join(out), "loss of every candidate")
    return f'<div style="margin-top:18px">{chart}</div>' + (legend(keys) if keys else "")


def _adds_up(match: dict[str, Any]) -> bool:
    terms = [v for v in (match.get("terms") or {}).values() if isinstance(v, int | float)]
    return bool(terms) and min(terms) >= 0 and abs(sum(terms) - _loss(match)) <= 0.01 * max(_loss(match), 1e-9)


def _table(matches: list[dict[str, Any]], names: list[str], accepted: bool) -> str:
    rows = []
    for i, m in enumerate(matches):
        pose = m.get("pose_K_O")
        placed = "–"
        if isinstance(pose, list) and len(pose) == 3 and all(isinstance(v, int | float) for v in pose):
            degrees = number(math.degrees(pose[2]), 0)
            placed = f"{number(pose[0], 0, scale=1e3)}, {number(pose[1], 0, 'mm', 1e3)}, {degrees}°"
        terms = m.get("terms") or {}
        index = f"<b>{esc(m.get('index', '?'))}</b>" + (
            ' <span class="chip good">taken</span>' if accepted and not i else ""
        )
        rows.append(
            [
                index,
                number(m.get("loss"), 3),
                *(number(terms.get(n), 3) for n in names),
                number(m.get("evidence"), 2),
                placed,
            ]
        )
    return "<h3>Losses and their terms</h3>" + table(
        ["candidate", "loss", *map(esc, names), "evidence", "pose x, y, yaw"], rows
    )
