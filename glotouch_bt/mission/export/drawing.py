"""Draw a mission's tree: as indented text, or as SVG."""

from __future__ import annotations

from dataclasses import dataclass

from glotouch_bt.escaped_text import html_text, visible
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.spec import NodeSpec

CHAR_PX, BOX_H, GAP_X, GAP_Y, MARGIN = 7.3, 46, 14, 34, 16


def details(node: NodeSpec) -> str:
    """Return what is set on a node and differs from the defaults, and how its ports are wired, in one line."""
    return "  ".join(kind_of(node).details(node))


def as_text(mission: Mission) -> str:
    """Return the tree, one node a line."""
    lines = [f"{mission.name}  ({mission.description})" if mission.description else mission.name]

    def add(node: NodeSpec, indent: str, last: bool) -> None:
        kind = kind_of(node)
        label = "" if kind.label(node) == node.name else f" [{kind.label(node)}]"
        lines.append(f"{indent}{'└─' if last else '├─'} {kind.sign} {node.name}{label}  {details(node)}".rstrip())
        for i, child in enumerate(node.children):
            add(child, indent + ("   " if last else "│  "), i == len(node.children) - 1)

    add(mission.spec, "", True)
    return visible("\n".join(lines)) + "\n"


@dataclass
class _Box:
    node: NodeSpec
    lines: tuple[str, str]
    x: float
    y: float
    width: float
    children: list[_Box]

    @property
    def middle(self) -> float:
        return self.x + 0.5 * self.width


def _layout(node: NodeSpec, left: float, depth: int) -> tuple[_Box, float]:
    """Lay out a subtree from x = `left`; returns its box and the x where the subtree ends."""
    text = details(node)
    text = text if len(text) <= 34 else text[:33] + "…"
    width = max(len(f"{kind_of(node).sign} {node.name}") * CHAR_PX * 1.08, len(text) * CHAR_PX * 0.82, 60) + 18
    children: list[_Box] = []
    x = left
    for child in node.children:
        box, x = _layout(child, x, depth + 1)
        children.append(box)
        x += GAP_X
    end = max(x - GAP_X, left + width) if children else left + width
    centre = 0.5 * (children[0].middle + children[-1].middle) if children else left + 0.5 * width
    start = max(left, centre - 0.5 * width)
    y = MARGIN + depth * (BOX_H + GAP_Y)
    return _Box(node, (node.name, text), start, y, width, children), max(end, start + width)


def as_svg(mission: Mission) -> str:
    """Return the tree as one self-contained SVG picture, children from left to right in tick order."""
    root, right = _layout(mission.spec, MARGIN, 0)
    shapes: list[str] = []
    depth = 0.0

    def draw(box: _Box) -> None:
        nonlocal depth
        depth = max(depth, box.y + BOX_H)
        for child in box.children:
            x0, y0, x1, y1 = box.middle, box.y + BOX_H, child.middle, child.y
            bend = 0.5 * (y0 + y1)
            path = f"M{x0:.1f} {y0:.1f}C{x0:.1f} {bend:.1f} {x1:.1f} {bend:.1f} {x1:.1f} {y1:.1f}"
            shapes.append(f'<path d="{path}" fill="none" stroke="#8a94a3"/>')
        title_y = box.y + (19 if box.lines[1] else 27)
        kind = kind_of(box.node)
        radius = 14 if box.node.skill_type is None else 3
        shapes.append(
            f"<g><title>{html_text(f'{box.node.kind}: {details(box.node)} ({box.node.place})')}</title>"
            f'<rect x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" height="{BOX_H}" rx="{radius}" '
            f'fill="{kind.fill}" stroke="#44505f"/>'
            f'<text x="{box.middle:.1f}" y="{title_y:.1f}" text-anchor="middle" font-weight="600">'
            f"{kind.sign} {html_text(box.lines[0])}</text>"
            f'<text x="{box.middle:.1f}" y="{box.y + 36:.1f}" text-anchor="middle" font-size="10.5" fill="#5b6675">'
            f"{html_text(box.lines[1])}</text></g>"
        )
        for child in box.children:
            draw(child)

    draw(root)
    width, height = right + MARGIN, depth + MARGIN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="ui-monospace, monospace" font-size="12.5" fill="#1d2733">'
        f"<title>{html_text(mission.name)}</title>"
        f'<rect width="100%" height="100%" fill="#fbfcfd"/>{"".join(shapes)}</svg>\n'
    )
