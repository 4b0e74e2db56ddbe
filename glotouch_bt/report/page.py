"""The report's page: one self-contained HTML file, light and dark, no script and nothing from the network."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence

from glotouch_bt.report.style import CSS


def esc(value: object) -> str:
    """Text safe inside HTML and SVG, attributes included."""
    return html.escape(str(value), quote=True)


def number(value: object, digits: int = 1, unit: str = "", scale: float = 1.0) -> str:
    """A number for people, or an en dash for what is missing or not finite."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return "–"
    return f"{value * scale:.{digits}f}{' ' if unit else ''}{unit}".replace("-", "−", 1)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numeric_from: int = 1) -> str:
    """An HTML table; cells are HTML already. Columns from `numeric_from` on are aligned right."""
    titles = "".join(f"<th{' class=n' if i >= numeric_from else ''}>{h}</th>" for i, h in enumerate(head))
    body = "".join(
        "<tr>" + "".join(f"<td{' class=n' if i >= numeric_from else ''}>{c}</td>" for i, c in enumerate(row)) + "</tr>"
        for row in rows
    )
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>'


def section(title: str, lead: str, body: str) -> str:
    """A titled part of the page with one sentence that says how to read it."""
    return f'<section><h2>{esc(title)}</h2><p class="lead">{lead}</p>{body}</section>'


def legend(entries: Iterable[tuple[str, str]]) -> str:
    """Keys of a chart: (CSS class of the swatch, HTML label)."""
    return '<p class="legend">' + "".join(f'<span><i class="{c}"></i>{label}</span>' for c, label in entries) + "</p>"


def page(title: str, body: str) -> str:
    """The whole document."""
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{esc(title)}</title><style>{CSS}</style></head><body><main>{body}</main></body></html>\n"
    )
