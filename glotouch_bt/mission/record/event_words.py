"""Recorded events in words: the one source of the record's log, of the live view and of reports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

MALFORMED = (AttributeError, IndexError, KeyError, TypeError, ValueError)
"""Errors of data of another shape."""
MAX_TEXT = 160
"""Characters of one line of the log."""
OBJECTS_RESULT = "candidates"
"""Key of the result that says how large the traced objects are."""
HIDDEN_EVENTS = frozenset({"sweep", "request", "request_done", "report"})
"""Events that logs leave out: many a second, or without a meaning for a person."""
_BAD, _WARN, _GOOD = (
    ("failure", "guard", "stuck"),
    ("fault", "ending", "reject", "put_back", "pause"),
    ("lift", "result"),
)
_TONES = {k: t for t, kinds in (("bad", _BAD), ("warn", _WARN), ("good", (*_GOOD, "object_check"))) for k in kinds}


def short_text(value: Any) -> str:
    """Return a value as one line: numbers to four digits, lists and objects shortened."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return "[" + ", ".join(short_text(v) for v in value[:8]) + (", …]" if len(value) > 8 else "]")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {short_text(v)}" for k, v in list(value.items())[:10]) + "}"
    return str(value)


def fields_in_words(data: Mapping[str, Any]) -> str:
    """Return the fields of an event: `force_N = 3.2, not held`. Node and text are left out, and what is None."""
    shown = ((k, v) for k, v in data.items() if k not in ("node", "text") and v is not None)
    return ", ".join(f"{'' if v else 'not '}{k}" if isinstance(v, bool) else f"{k} = {short_text(v)}" for k, v in shown)


def objects_in_words(candidates: Iterable[Any]) -> str:
    """Return the sizes of recorded candidates: `2 objects traced: 103 × 44 × 63, 62 × 62 mm`; nothing without any.

    The third number is the height, once the top was touched.
    """
    sizes = [size for c in candidates if (size := _size_in_words(c))]
    return f"{len(sizes)} object{'s' if len(sizes) > 1 else ''} traced: {', '.join(sizes)} mm" if sizes else ""


def _size_in_words(candidate: Any) -> str:
    try:
        long, short = candidate["contour"]["size_m"]
        sides = (long, short, candidate["height_m"]) if candidate["top_touched"] else (long, short)
        return " × ".join(f"{1e3 * side:.0f}" for side in sides)
    except MALFORMED:
        return ""


def event_tone(kind: str) -> str:
    """Return good, warn or bad, or nothing."""
    return _TONES.get(kind, "")


def event_words(kind: str, d: dict[str, Any]) -> str:
    """Return an event as one line."""
    try:
        text = _words(kind, d)
    except MALFORMED:
        text = None
    if text is None:
        text = "; ".join(part for part in (str(d.get("text") or ""), fields_in_words(d)) if part)
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 1] + "…"


def _words(kind: str, d: dict[str, Any]) -> str | None:
    """Return the sentence of an event that has one."""
    if kind == "result":
        return str(d["text"])
    if kind == "contact":
        return f"{d['contact']['force_N']:.1f} N"
    if kind == "candidate":
        c = d["candidate"]
        long, short = (1e3 * v for v in c["contour"]["size_m"])
        return (
            f"{c['index']}: {c['contour'].get('family')}, {long:.0f} × {short:.0f} mm, {d.get('ended') or 'measured'}"
        )
    if kind == "top":
        return f"candidate {d['candidate']}: {1e3 * d['height_m']:.0f} mm high"
    if kind == "failure":
        return f"{str(d.get('node', '')).rsplit('/', 1)[-1]}: {d.get('message') or d.get('code')}"
    if kind == "next_probe":
        touch = d.get("touch")
        return f"{touch['part']} of candidate {touch['candidate']}" if touch else f"no more: {d.get('why')}"
    if kind == "closure":
        c = d["chosen"]
        return f"{d['number']}: candidate {c['candidate']} at {1e3 * c['height_m']:.0f} mm"
    if kind == "decided":
        return str(d["why"])
    if kind == "touchset":
        layers = sum(len(s.get("layers") or ()) for s in d["touchset"]["sequences"])
        return f"candidate {d['touchset']['candidate']['index']}: {layers} closures"
    if kind == "plan":
        p = d["plan"]
        height, width = 1e3 * p["position_K_m"][2], 1e3 * p["aperture_m"]
        return f"grasp candidate {p['candidate']} at {height:.0f} mm, {width:.0f} mm wide"
    if kind == "ranking":
        return f"{d.get('target') or 'target'} {'accepted' if d['ranking']['accepted'] else 'not accepted'}"
    return None
