"""The section of the timeline: when each node of the tree ran, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass

from glotouch_bt.report.page import esc, legend, section
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.svg import AxisScale, label, picture, x_axis

MAX_ROWS = 60
"""Nodes shown."""
_COLOUR = {"SUCCESS": "var(--good)", "FAILURE": "var(--bad)"}


@dataclass(frozen=True)
class Span:
    """One run of a node: from its first tick to the status it ended with."""

    node: str
    start_s: float
    end_s: float
    status: str


def spans(record: RunRecord) -> list[Span]:
    """Return all runs of all nodes in order of their start; a run without an end has the status RUNNING."""
    begun: dict[str, float] = {}
    out: list[Span] = []
    for tick in record.ticks:
        if tick.new == "RUNNING":
            begun.setdefault(tick.node, tick.stamp_s)
        elif tick.node in begun:
            out.append(Span(tick.node, begun.pop(tick.node), tick.stamp_s, tick.new))
        elif tick.new in _COLOUR:
            out.append(Span(tick.node, tick.stamp_s, tick.stamp_s, tick.new))
    end_s = record.span_s[1]
    out += [Span(node, start, end_s, "RUNNING") for node, start in begun.items()]
    return sorted(out, key=lambda s: (s.start_s, s.node.count("/")))


def timeline_section(record: RunRecord) -> str:
    """Return the section, or nothing if no tick was recorded."""
    found = spans(record)
    if not found:
        return ""
    nodes = tree_order([s.node for s in found])
    total = len(nodes)
    if total > MAX_ROWS:  # show the upper levels
        depth = max(d for d in range(1, 40) if sum(n.count("/") < d for n in nodes) <= MAX_ROWS or d == 1)
        nodes = [n for n in nodes if n.count("/") < depth][:MAX_ROWS]
    start_s, end_s = record.span_s
    width, left, right, row, top = 1060.0, 250.0, 1050.0, 22.0, 8.0
    bottom = top + row * len(nodes) + 4
    x = AxisScale(start_s, max(end_s, start_s + 1e-3), left, right)
    out = [x_axis(x, top, bottom, "robot clock, s")]
    lines = {n: i for i, n in enumerate(nodes)}
    for n, i in lines.items():
        depth = n.count("/")
        name = n.rsplit("/", 1)[-1]
        name = name if len(name) <= 34 - 2 * depth else name[: 33 - 2 * depth] + "…"
        css = "ink b" if depth == 0 else "ink"
        out.append(f"<g><title>{esc(n)}</title>{label(4 + 14 * depth, top + row * i + 15, esc(name), css)}</g>")
    for s in found:
        if s.node not in lines:
            continue
        y = top + row * lines[s.node] + 5
        x0, x1 = x.at(s.start_s), x.at(s.end_s)
        text = f"<title>{esc(s.node)}: {esc(s.status)}, {s.start_s:.2f} to {s.end_s:.2f} s</title>"
        colour = _COLOUR.get(s.status, "var(--idle)")
        if s.end_s > s.start_s:
            thin = 1.0 if "/" in s.node else 0.55
            out.append(
                f'<rect x="{x0:.1f}" y="{y:.1f}" width="{max(x1 - x0, 1.5):.1f}" height="12" rx="2.5" fill="{colour}" '
                f'opacity="{thin}">{text}</rect>'
            )
        else:
            out.append(
                f'<path d="M{x0:.1f} {y + 1:.1f}l5 5l-5 5l-5-5z" fill="{colour}" stroke="var(--card)">{text}</path>'
            )
    chart = picture(width, bottom + 38, "".join(out), "status of the tree's nodes over time")
    keys = [("k-good", "succeeded"), ("k-bad", "failed"), ("k-idle", "stopped or still running")]
    more = f" The {len(nodes)} upper nodes of {total} are shown." if len(nodes) < total else ""
    lead = (
        "Each line is a node of the mission's tree, with its children indented. A bar is one run of the node; a "
        f"diamond is a run that ended in the same tick.{more}"
    )
    return section("Timeline of the tree", lead, chart + legend(keys))


def tree_order(nodes: list[str]) -> list[str]:
    """Return each node once, parents before children, siblings in the order of their first run."""
    first: dict[str, int] = {}
    for i, n in enumerate(nodes):
        for cut in [k for k, c in enumerate(n) if c == "/"] + [len(n)]:
            first.setdefault(n[:cut], i)
    seen = set(nodes)

    def key(n: str) -> list[tuple[int, str]]:
        cuts = [k for k, c in enumerate(n) if c == "/"] + [len(n)]
        return [(first[n[:cut]], n[:cut]) for cut in cuts]

    return sorted(seen, key=key)
