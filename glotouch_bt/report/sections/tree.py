"""The section of the behavior tree: every node with how it ended, and when it ran. It folds without a script."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from glotouch_bt.report.page import esc, legend, section
from glotouch_bt.report.run_record import RunRecord
from glotouch_bt.report.state import TreeNode, planned_nodes, tree_of, tree_order

OPEN_LEVELS = 3
"""Levels that are unfolded; below, a node is unfolded if it and all above it failed or were stopped."""
_LOOKS = {"SUCCESS": ("✓", "good"), "FAILURE": ("✕", "bad"), "RUNNING": ("▪", "warn"), "": ("·", "idle")}
"""Sign and colour of a node by how its last run ended; "": it never ran."""


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
        elif tick.new in _LOOKS:
            out.append(Span(tick.node, tick.stamp_s, tick.stamp_s, tick.new))
    end_s = record.span_s[1]
    out += [Span(node, start, end_s, "RUNNING") for node, start in begun.items()]
    return sorted(out, key=lambda s: (s.start_s, s.node.count("/")))


def tree_section(record: RunRecord) -> str:
    """Return the section, or nothing if no tick was recorded."""
    runs: dict[str, list[Span]] = defaultdict(list)
    for span in spans(record):
        runs[span.node].append(span)
    if not runs:
        return ""
    planned = planned_nodes(record.path.parent)
    nodes = tree_order([*planned, *(n for n in runs if n not in set(planned))])
    start_s, end_s = record.span_s
    picture = _Picture(runs, start_s, max(end_s - start_s, 1e-3))
    root = tree_of({n: runs[n][-1].status if n in runs else "" for n in nodes})
    keys = [("k-good", "succeeded"), ("k-bad", "failed"), ("k-warn", "stopped")]
    keys.append(("k-idle", "never ran"))
    lead = (
        f"Each line is a node, its children below it; a click folds them. The strip shows its runs from "
        f"{max(start_s, 0.0):.0f} to {end_s:.0f} s of the robot's clock."
    )
    body = "".join(picture.branch(child, 0, True) for child in root.children)
    return section("Behavior tree", lead, f'<div class="tree">{body}</div>{legend(keys)}')


@dataclass(frozen=True)
class _Picture:
    """Draws the lines: `runs` of each node within `span_s` from `start_s` on."""

    runs: dict[str, list[Span]]
    start_s: float
    span_s: float

    def branch(self, node: TreeNode, depth: int, failing: bool) -> str:
        """Return a node and everything below it; a chain of only children is one line."""
        names, node = node.chain()
        line = self._line(node, names, depth)
        if not node.children:
            return f'<div class="leaf">{line}</div>'
        failing = failing and node.status not in ("SUCCESS", "")
        below = "".join(self.branch(child, depth + 1, failing) for child in node.children)
        return f"<details{' open' if failing or depth < OPEN_LEVELS else ''}><summary>{line}</summary>{below}</details>"

    def _line(self, node: TreeNode, names: list[str], depth: int) -> str:
        runs = self.runs.get(node.path, [])
        sign, tone = _LOOKS.get(node.status, _LOOKS["RUNNING"])
        failed = sum(r.status == "FAILURE" for r in runs)
        seconds = sum(r.end_s - r.start_s for r in runs)
        count = f"{len(runs)}×" + (f", {failed} failed" if failed and len(runs) > 1 else "") if len(runs) > 1 else ""
        facts = ", ".join([*([count] if count else []), *([f"{seconds:.1f} s"] if runs else [])])
        strip = f'<svg viewBox="0 0 1000 10" preserveAspectRatio="none" aria-hidden="true">{self._strip(runs)}</svg>'
        return (
            f'<span class="node {tone}" style="--d:{depth}" title="{esc(node.path)}"><b>{sign}</b> '
            f"<span>{esc(' › '.join(names))}</span> <small>{facts}</small></span>{strip}"
        )

    def _strip(self, runs: list[Span]) -> str:
        """Return one path for each way to end."""
        out = []
        for status, (_, tone) in _LOOKS.items():
            bars = []
            for r in (r for r in runs if (r.status if r.status in _LOOKS else "RUNNING") == status):
                left, width = ((v / self.span_s * 1e3) for v in (r.start_s - self.start_s, r.end_s - r.start_s))
                bars.append(f"M{left:.1f} 0h{max(width, 2.0):.1f}v10h-{max(width, 2.0):.1f}z")
            if bars:
                out.append(f'<path d="{"".join(bars)}" fill="var(--{tone})"/>')
        return "".join(out)
