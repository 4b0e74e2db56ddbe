"""The rows of the tree panel: the running branch in full, everything else folded to one line. Pure."""

from __future__ import annotations

from dataclasses import dataclass

TOP_LEVELS = 2
"""Levels that are unfolded when nothing runs."""


@dataclass(frozen=True)
class TreeRow:
    """One line of the tree.

    Attributes:
        label: Name of the node; a chain of only children has the names of its ends.
        path: Names of the whole chain.
        depth: Indentation.
        status: RUNNING, SUCCESS, FAILURE, INVALID (not running any more) or "" (not run yet).
        folded: Number of nodes below that are not shown.
    """

    label: str
    path: str
    depth: int
    status: str
    folded: int = 0


@dataclass
class _Node:
    name: str
    status: str
    children: list[_Node]

    def count(self) -> int:
        return sum(1 + c.count() for c in self.children)


def tree_rows(nodes: dict[str, str], *, whole: bool = False) -> list[TreeRow]:
    """Return the lines of a tree.

    A node is unfolded while it runs. When nothing runs, the top levels and the failed nodes are, to show how it ended.

    Args:
        nodes: Status of each node by its path, parents before their children.
        whole: Unfold everything.
    """
    root = _Node("", "INVALID", [])
    places: dict[str, _Node] = {"": root}
    for path, status in nodes.items():
        parent = path
        while True:  # a parent that never had a status of its own is left out
            parent = parent.rsplit("/", 1)[0] if "/" in parent else ""
            if parent in places:
                break
        places[path] = node = _Node(path.rsplit("/", 1)[-1], status, [])
        places[parent].children.append(node)
    running = any(s == "RUNNING" for s in nodes.values())
    rows: list[TreeRow] = []

    def add(node: _Node, depth: int) -> None:
        names = [node.name]
        while len(node.children) == 1 and node.children[0].status == node.status:
            node = node.children[0]
            names.append(node.name)
        ends = names if len(names) < 3 else [names[0], "…", names[-1]]
        unfold = whole or (node.status == "RUNNING" if running else node.status == "FAILURE" or depth < TOP_LEVELS)
        rows.append(TreeRow(" › ".join(ends), " › ".join(names), depth, node.status, 0 if unfold else node.count()))
        if unfold:
            for child in node.children:
                add(child, depth + 1)

    for child in root.children:
        add(child, 0)
    return rows
