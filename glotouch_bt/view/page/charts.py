"""Small charts of the page as SVG text: force and jaw opening of the last seconds, and the strip of the time line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glotouch_bt.escaped_text import html_text
from glotouch_bt.report import AxisScale, points, tick_text
from glotouch_bt.report.state import LogLine, RunModel
from glotouch_bt.robot import Array

WIDTH, LEFT, RIGHT = 340.0, 30.0, 334.0
WINDOW_S = 30.0
"""Robot time in the charts. Source: ours; a probe motion takes 5 to 15 s."""
BINS = 400
"""Points of a line; more are drawn as the largest of each bin."""
FORCE, APERTURE, TOUCH, MARK = "#2567c9", "#c77700", "#d23c28", "#c5352b"
MIN_FORCE_N, MIN_OPENING_M = 2.0, 0.02
"""Smallest range of a chart."""


def signals(model: RunModel, t_s: float) -> str:
    """Return the charts of wrist force and jaw opening over the last `WINDOW_S` before `t_s`."""
    start = max(t_s - WINDOW_S, model.span_s[0])
    x = AxisScale(start, max(t_s, start + 1.0), LEFT, RIGHT)
    stamps = [t for t in model.touch_stamps_s if start <= t <= t_s]
    force = _line(model.motion.rows if model.motion is not None else np.zeros((0, 2)), 1, start, t_s)
    opening = _line(model.jaws.rows, 1, start, t_s)
    high_N = max(MIN_FORCE_N, float(force[1].max(initial=0.0)) * 1.1)
    high_mm = 1e3 * max(MIN_OPENING_M, float(opening[1].max(initial=0.0)) * 1.1)
    return _chart("wrist force, N", x, AxisScale(0.0, high_N, 84, 14), force, FORCE, stamps) + _chart(
        "jaw opening, mm", x, AxisScale(0.0, high_mm, 62, 14), (opening[0], 1e3 * opening[1]), APERTURE, ()
    )


def _line(rows: Array, column: int, start_s: float, end_s: float) -> tuple[Array, Array]:
    """Return stamps and values inside a window, at most `BINS` of them: the largest of each bin."""
    a, b = np.searchsorted(rows[:, 0], [start_s, end_s + 1e-9])
    t, v = rows[a:b, 0], rows[a:b, column]
    if len(t) > BINS:
        edges = np.unique(np.linspace(0, len(t), BINS + 1).astype(int))[:-1]
        t, v = t[edges], np.maximum.reduceat(v, edges)
    return t, v


def _chart(
    title: str, x: AxisScale, y: AxisScale, line: tuple[Array, Array], colour: str, touches: Sequence[float]
) -> str:
    bottom, height = y.start, y.start + 18
    out = []
    for v in y.ticks(3):
        py = y.at(v)
        out.append(f'<line x1="{LEFT}" x2="{RIGHT}" y1="{py:.1f}" y2="{py:.1f}" stroke="#e3e7ec"/>')
        out.append(f'<text x="{LEFT - 5}" y="{py + 3.5:.1f}" text-anchor="end">{tick_text(v)}</text>')
    out += [
        f'<text x="{x.at(t):.1f}" y="{bottom + 14:.1f}" text-anchor="middle">{tick_text(t)}</text>' for t in x.ticks(5)
    ]
    for t in touches:
        px = x.at(t)
        out.append(f'<path d="M{px:.1f} {bottom:.1f}v-7" stroke="{TOUCH}" stroke-width="2"/>')
    if len(line[0]) > 1:
        out.append(
            f'<polyline points="{points(x(line[0]), y(line[1]))}" fill="none" stroke="{colour}" stroke-width="1.4" '
            'stroke-linejoin="round"/>'
        )
        px, py, value = x.at(float(line[0][-1])), y.at(float(line[1][-1])), float(line[1][-1])
        out.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="3" fill="{colour}"/>')
        out.append(f'<text x="{RIGHT}" y="10" text-anchor="end" font-weight="600" fill="{colour}">{value:.1f}</text>')
    out.append(f'<text x="{LEFT}" y="10">{html_text(title)}</text>')
    return _svg(height, "".join(out), title)


def strip(model: RunModel, t_s: float, width: float = 290.0) -> str:
    """Return the strip of the whole run: its force, its contacts, what failed, and the time that is shown."""
    start, end = model.span_s
    x = AxisScale(start, max(end, start + 1.0), 0.0, width)
    t, v = _line(model.motion.rows if model.motion is not None else np.zeros((0, 2)), 1, start, end)
    y = AxisScale(0.0, max(MIN_FORCE_N, float(v.max(initial=0.0))), 30.0, 2.0)
    out = [f'<rect width="{width}" height="30" fill="#f1f3f6" rx="3"/>']
    if len(t) > 1:
        area = np.concatenate([t, t[::-1]]), np.concatenate([v, np.zeros(len(v))])
        out.append(f'<polygon points="{points(x(area[0]), y(area[1]))}" fill="{FORCE}" fill-opacity=".45"/>')
    out += [f'<path d="M{x.at(at):.1f} 30v-4" stroke="{TOUCH}"/>' for at in model.touch_stamps_s]
    out += [_mark(x.at(m.stamp_s), m) for m in model.marks.values]
    px = x.at(t_s)
    out.append(f'<path d="M{px:.1f} 0v30" stroke="#14181f" stroke-width="1.6"/>')
    return f'<div style="padding-bottom:6px">{_svg(30.0, "".join(out), "the whole run", width)}</div>'


def _mark(px: float, mark: LogLine) -> str:
    title = f"<title>{html_text(f'{mark.stamp_s:.1f} s: {mark.text}')}</title>"
    return f'<path d="M{px - 4:.1f} 0h8l-4 8z" fill="{MARK}">{title}</path>'


def _svg(height: float, body: str, title: str, width: float = WIDTH) -> str:
    return (
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{html_text(title)}" '
        f'style="display:block;width:100%" font-size="10.5" fill="#5a6472">{body}</svg>'
    )
