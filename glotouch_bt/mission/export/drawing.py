"""Draw a mission's tree: as indented text, or as SVG."""

from __future__ import annotations

from glotouch_bt.escaped_text import html_text, visible
from glotouch_bt.mission.load import Mission
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.spec import NodeSpec

CHAR_PX, BOX_H, LINE_H, INDENT, MARGIN = 7.3, 22, 28, 24, 12
MAX_DETAILS = 56
"""Characters of a node's details in the picture; its tooltip has all."""


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


def as_svg(mission: Mission) -> str:
    """Return the tree as one self-contained SVG picture: a node a line, its children below it in tick order."""
    shapes: list[str] = []
    width = 0.0

    def draw(node: NodeSpec, depth: int) -> float:
        """Draw a subtree; return the height of its first line."""
        nonlocal width
        x, y = MARGIN + depth * INDENT, MARGIN + len(shapes) * LINE_H
        kind, text = kind_of(node), details(node)
        short = text if len(text) <= MAX_DETAILS else text[: MAX_DETAILS - 1] + "…"
        title = f"{kind.sign} {node.name}"
        end = x + len(title) * CHAR_PX * 1.08 + 18
        width = max(width, end + len(short) * CHAR_PX * 0.82 + 10)
        place = len(shapes)
        shapes.append("")
        below = "".join(
            f'<path d="M{x + 9} {y + BOX_H:.0f}V{draw(child, depth + 1) + BOX_H / 2:.0f}h{INDENT - 9}" fill="none" '
            'stroke="#8a94a3"/>'
            for child in node.children
        )
        shapes[place] = (
            f"{below}<g><title>{html_text(f'{node.kind}: {text} ({node.place})')}</title>"
            f'<rect x="{x}" y="{y}" width="{end - x:.0f}" height="{BOX_H}" rx="{11 if node.skill_type is None else 3}" '
            f'fill="{kind.fill}" stroke="#44505f"/>'
            f'<text x="{x + 9}" y="{y + 15}" font-weight="600">{html_text(title)}</text>'
            f'<text x="{end + 8:.0f}" y="{y + 15}" font-size="10.5" fill="#5b6675">{html_text(short)}</text></g>'
        )
        return y

    draw(mission.spec, 0)
    height = 2 * MARGIN + len(shapes) * LINE_H
    width += MARGIN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="ui-monospace, monospace" font-size="12.5" fill="#1d2733">'
        f"<title>{html_text(mission.name)}</title>"
        f'<rect width="100%" height="100%" fill="#fbfcfd"/>{"".join(shapes)}</svg>\n'
    )
