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
class TreeNode:
    """A node of a tree with its status; the root of `tree_of` has no name."""

    name: str
    path: str
    status: str
    children: list[TreeNode]

    def count(self) -> int:
        """Return the number of nodes below."""
        return sum(1 + c.count() for c in self.children)

    def chain(self) -> tuple[list[str], TreeNode]:
        """Return the names from here down a chain of only children of the same status, and its last node."""
        node, names = self, [self.name]
        while len(node.children) == 1 and node.children[0].status == node.status:
            node = node.children[0]
            names.append(node.name)
        return names, node


def tree_of(nodes: dict[str, str]) -> TreeNode:
    """Return the tree of nodes with a status each, by path, parents before their children."""
    root = TreeNode("", "", "INVALID", [])
    places = {"": root}
    for path, status in nodes.items():
        parent = path
        while True:  # a parent that never had a status of its own is left out
            parent = parent.rsplit("/", 1)[0] if "/" in parent else ""
            if parent in places:
                break
        places[path] = node = TreeNode(path.rsplit("/", 1)[-1], path, status, [])
        places[parent].children.append(node)
    return root


def tree_rows(nodes: dict[str, str], *, whole: bool = False) -> list[TreeRow]:
    """Return the lines of a tree.

    A node is unfolded while it runs. When nothing runs, the top levels and the failed nodes are, to show how it ended.

    Args:
        nodes: Status of each node by its path, parents before their children.
        whole: Unfold everything.
    """
    root = tree_of(nodes)
    running = any(s == "RUNNING" for s in nodes.values())
    rows: list[TreeRow] = []

    def add(node: TreeNode, depth: int) -> None:
        names, node = node.chain()
        ends = names if len(names) < 3 else [names[0], "…", names[-1]]
        unfold = whole or (node.status == "RUNNING" if running else node.status == "FAILURE" or depth < TOP_LEVELS)
        rows.append(TreeRow(" › ".join(ends), " › ".join(names), depth, node.status, 0 if unfold else node.count()))
        if unfold:
            for child in node.children:
                add(child, depth + 1)

    for child in root.children:
        add(child, 0)
    return rows


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
