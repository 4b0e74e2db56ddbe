"""The section of the recognition: loss or probability of each candidate, its terms, and the gates or reasons."""

from __future__ import annotations

import math
from typing import Any

from glotouch_bt.report.page import esc, legend, number, section, table
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.svg import AxisScale, label, picture, x_axis

COLOURS = 6


def recognition_section(record: RunRecord) -> str:
    """Return the last ranking, or nothing."""
    events = record.of_kind("ranking")
    if not events:
        return ""
    data = events[-1].data
    ranking = data["ranking"] if isinstance(data.get("ranking"), dict) else data
    matches = [m for m in ranking.get("matches") or [] if isinstance(m, dict)]
    names = sorted({n for m in matches for n in (m.get("terms") or {})})
    accepted = bool(ranking.get("accepted"))
    target = data.get("target") or record.result.get("target") or "the target"
    if not (data.get("gates") or ranking.get("gates")) and matches and all(_share(m) is not None for m in matches):
        return _by_probability(ranking, matches, names, esc(target))
    matches.sort(key=lambda m: (_loss(m), str(m.get("index"))))
    lead = (
        f"The loss of each candidate as {esc(target)}, lowest first. The best is accepted only if its margin, loss and "
        "evidence pass the gates."
    )
    body = _gates(ranking, data, matches) + _bars(matches, names) + _table(matches, names, accepted)
    return section("Recognition", lead, body)


def _by_probability(ranking: dict[str, Any], matches: list[dict[str, Any]], names: list[str], target: str) -> str:
    """Return the section for a matcher with probabilities: of each candidate and of none."""
    accepted = bool(ranking.get("accepted"))
    matches = sorted(matches, key=lambda m: -(_share(m) or 0.0))
    lead = (
        f"The probability that each candidate, or none of them, is {target}. The best is accepted only if its share of "
        "the candidates' probabilities reaches the mission's <code>confidence</code>, if none of them is improbable "
        "enough, and if its evidence is high enough. The terms are in nats; positive values support the target."
    )
    shares = [(f"candidate {esc(m.get('index', '?'))}", _share(m) or 0.0) for m in matches]
    absent = ranking.get("p_absent")
    if isinstance(absent, int | float):
        shares.append(("none of them", float(absent)))
    body = _verdict(ranking) + _share_bars(shares) + _table(matches, names, accepted, "probability", "Evidence")
    return section("Recognition", lead, body)


def _share(match: dict[str, Any]) -> float | None:
    value = match.get("probability")
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _share_bars(shares: list[tuple[str, float]]) -> str:
    """Return one bar per hypothesis, from 0 to 1."""
    return _chart([(name, [(name, share)], share) for name, share in shares], 1.0, "probability", "probabilities")


def _chart(rows: list[tuple[str, list[tuple[str, float]], float]], high: float, axis: str, title: str) -> str:
    """Return a bar chart of (name, parts of the bar, total); without parts there are no data."""
    width, left, right, row, top = 1060.0, 110.0, 980.0, 30.0, 14.0
    bottom = top + row * len(rows)
    x = AxisScale(0.0, high, left, right)
    out = [x_axis(x, top - 6, bottom, axis, about=8)]
    for i, (name, parts, total) in enumerate(rows):
        y = top + row * i
        out.append(label(left - 12, y + 16, name, "ink e" + (" b" if i == 0 else "")))
        if not parts:
            out.append(label(left + 6, y + 16, "no data"))
            continue
        at = left
        for k, (part, value) in enumerate(parts):
            w = x.at(value) - left
            if w > 0.05 or len(parts) == 1:
                out.append(
                    f'<rect x="{at:.1f}" y="{y + 3:.1f}" width="{w:.1f}" height="18" fill="var(--t{k % COLOURS})" '
                    f'stroke="var(--card)"><title>{part}: {value:.4f}</title></rect>'
                )
            at += max(w, 0.0)
        out.append(label(x.at(total) + 8, y + 16, number(total, 3), "ink b"))
    return f'<div style="margin-top:18px">{picture(width, bottom + 38, "".join(out), title)}</div>'


def _verdict(ranking: dict[str, Any], details: str = "") -> str:
    """Return accepted or not, with the reasons."""
    accepted = bool(ranking.get("accepted"))
    chip = '<span class="chip good">accepted</span>' if accepted else '<span class="chip bad">not accepted</span>'
    reasons = "".join(f"<li>{esc(r)}</li>" for r in ranking.get("reasons") or [])
    return f"<p>{chip}</p>{details}" + (f"<ul>{reasons}</ul>" if reasons else "")


def _loss(match: dict[str, Any]) -> float:
    value = match.get("loss")
    return float(value) if isinstance(value, int | float) else math.inf


def _gates(ranking: dict[str, Any], data: dict[str, Any], matches: list[dict[str, Any]]) -> str:
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
    return _verdict(ranking, table(["gate", "found", "needed", ""], rows))


def _bars(matches: list[dict[str, Any]], names: list[str]) -> str:
    """Return one bar per candidate, split into terms if these add up to the loss."""
    finite = [m for m in matches if math.isfinite(_loss(m))]
    if not finite:
        return ""
    split = bool(names) and all(_adds_up(m) for m in finite)
    rows: list[tuple[str, list[tuple[str, float]], float]] = []
    for m in matches:
        terms = m.get("terms") or {}
        parts = [(esc(n), float(terms.get(n) or 0.0)) for n in names] if split else [("loss", _loss(m))]
        rows.append((f"candidate {esc(m.get('index', '?'))}", parts if math.isfinite(_loss(m)) else [], _loss(m)))
    high = max(max(_loss(m) for m in finite), 1e-9) * 1.02
    keys = [(f"k-t{k % COLOURS}", esc(n)) for k, n in enumerate(names)] if split else []
    return _chart(rows, high, "loss", "loss of every candidate") + (legend(keys) if keys else "")


def _adds_up(match: dict[str, Any]) -> bool:
    terms = [v for v in (match.get("terms") or {}).values() if isinstance(v, int | float)]
    return bool(terms) and min(terms) >= 0 and abs(sum(terms) - _loss(match)) <= 0.01 * max(_loss(match), 1e-9)


def _table(
    matches: list[dict[str, Any]],
    names: list[str],
    accepted: bool,
    score: str = "loss",
    title: str = "Losses and their terms",
) -> str:
    rows = []
    for i, m in enumerate(matches):
        pose = m.get("pose_K_O")
        placed = "–"
        if isinstance(pose, list) and len(pose) == 3 and all(isinstance(v, int | float) for v in pose):
            degrees = number(math.degrees(pose[2]), 0)
            placed = (
                f"{number(pose[0], 0, scale=1e3)}, {number(pose[1], 0, 'mm', 1e3)}, {degrees}°{_side(m.get('quat'))}"
            )
        terms = m.get("terms") or {}
        index = f"<b>{esc(m.get('index', '?'))}</b>" + (
            ' <span class="chip good">taken</span>' if accepted and not i else ""
        )
        rows.append(
            [
                index,
                number(m.get(score), 3),
                *(number(terms.get(n), 3) for n in names),
                number(m.get("evidence"), 2),
                placed,
            ]
        )
    return f"<h3>{title}</h3>" + table(["candidate", score, *map(esc, names), "evidence", "pose x, y, yaw, side"], rows)


def _side(quat: Any) -> str:
    """Return the side on which the target is taken to stand, by the turn from that of its file."""
    if not (isinstance(quat, list) and len(quat) == 4 and all(isinstance(v, int | float) for v in quat)):
        return ""
    turn = math.degrees(2.0 * math.acos(min(abs(quat[0]), 1.0)))
    return ", as in its file" if turn < 1.0 else f", turned over by {number(turn, 0)}°"
