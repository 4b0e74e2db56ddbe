"""The HTML of the report: one self-contained page, light and dark. It loads nothing, and runs only its own script."""

from __future__ import annotations

import base64
import hashlib
import math
from collections.abc import Iterable, Sequence

from glotouch_bt.escaped_text import html_text as esc
from glotouch_bt.report.style import CSS


def number(value: object, digits: int = 1, unit: str = "", scale: float = 1.0) -> str:
    """Format a number, or an en dash if it is missing or not finite."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return "–"
    return f"{value * scale:.{digits}f}{' ' if unit else ''}{unit}".replace("-", "−", 1)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric_from: int = 1) -> str:
    """Return an HTML table of HTML cells; columns from `numeric_from` on are right-aligned."""
    titles = "".join(f"<th{' class=n' if i >= numeric_from else ''}>{h}</th>" for i, h in enumerate(head))
    body = "".join(
        "<tr>" + "".join(f"<td{' class=n' if i >= numeric_from else ''}>{c}</td>" for i, c in enumerate(row)) + "</tr>"
        for row in rows
    )
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>'


def section(title: str, lead: str, body: str) -> str:
    """Return a titled section of the page; `lead` explains how to read it."""
    return f'<section><h2>{esc(title)}</h2><p class="lead">{lead}</p>{body}</section>'


def legend(entries: Iterable[tuple[str, str]]) -> str:
    """Return the legend of a chart from (CSS class of the swatch, HTML label)."""
    return '<p class="legend">' + "".join(f'<span><i class="{c}"></i>{label}</span>' for c, label in entries) + "</p>"


def page(title: str, body: str, script: str = "") -> str:
    """Return the whole document.

    Its policy forbids everything from elsewhere, and every script but `script`, which the browser knows by its digest.
    """
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = f"script-src 'sha256-{digest}'; " if script else ""
    policy = (
        f"default-src 'none'; {allowed}style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{esc(title)}</title><style>{CSS}</style></head><body><main>{body}</main>"
        + (f"<script>{script}</script>" if script else "")
        + "</body></html>\n"
    )
