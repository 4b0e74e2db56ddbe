"""How far a tree has come, at the moment one of its skills ended; and a fresh tree brought to that moment.

The moment lies inside a tick: the skill has ended, nothing above has reacted to it yet, and the next skill has done
nothing. A tree that is brought there hands the skill's end up once more in its first tick, and so goes on exactly as
the first one did. What else had finished earlier in that tick is handed up again, too; what was running beside it (in
a parallel) starts from its beginning.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

from glotouch_bt.mission.nodes import MissionDecorator
from glotouch_bt.mission.tree import BuiltTree
from glotouch_bt.robot import BadInput
from glotouch_bt.skill import Skill


def tree_state(tree: BuiltTree, finished: Sequence[Behaviour]) -> dict[str, Any]:
    """How far the tree has come.

    Args:
        tree: A tree in the midst of a tick.
        finished: The nodes that have ended in this tick so far, in their order; the last one has just done so.
    """
    return {
        "finished": tuple(tree.paths[n.id] for n in finished),
        "nodes": {tree.paths[n.id]: _node_state(n, tree) for n in tree.root.iterate()},
    }


def _node_state(node: Behaviour, tree: BuiltTree) -> dict[str, Any]:
    state: dict[str, Any] = {"status": node.status.value}
    if node.feedback_message:
        state["feedback"] = node.feedback_message
    if isinstance(node, Composite) and node.current_child is not None:
        state["child"] = tree.paths[node.current_child.id]
    if isinstance(node, MissionDecorator):
        state["progress"] = node.progress
    if getattr(node, "reason", None) is not None:
        state["reason"] = node.reason
    if isinstance(node, Skill):
        remembered = node.remember()
        if remembered is not None:
            state["remembered"] = remembered
    return state


class TreeState:
    """A fresh tree brought to where another one stood; tick it once, then call `done`.

    Args:
        tree: The same tree, built anew.
        state: What `tree_state` gave.

    Raises:
        BadInput: The state is of another tree.
    """

    def __init__(self, tree: BuiltTree, state: Mapping[str, Any]) -> None:
        self._handed_up: list[Behaviour] = []
        nodes = _by_path(tree)
        if state["nodes"].keys() != nodes.keys():
            odd = ", ".join(sorted(state["nodes"].keys() ^ nodes.keys())[:3])
            raise BadInput(f"the checkpoint is of another tree (nodes that are not in both: {odd})")
        for path, node in nodes.items():
            _set_node(node, state["nodes"][path], nodes)
        for path in state["finished"]:
            self._hand_up(nodes[path])
        if state["finished"]:
            ended = nodes[state["finished"][-1]]
            for node in (ended, *_ancestors(ended)):
                node.status = Status.RUNNING

    def replays(self, node: Behaviour) -> bool:
        """The node's end is not a new one: it is being handed up once more."""
        return node in self._handed_up

    def done(self) -> None:
        """The first tick is over."""
        for node in self._handed_up:
            vars(node).pop("tick", None)
        self._handed_up = []

    def _hand_up(self, node: Behaviour) -> None:
        final = node.status
        if final not in (Status.SUCCESS, Status.FAILURE):  # broken off again by what ended after it
            return

        def tick() -> Iterator[Behaviour]:
            vars(node).pop("tick", None)
            node.status = final
            yield node

        node.tick = tick
        self._handed_up.append(node)


def start_at(tree: BuiltTree, state: Mapping[str, Any], path: str) -> None:
    """Bring a fresh tree to where a node is about to begin, whatever the state's own next one is.

    What comes before it in a sequence counts as done, in a selector as failed. Loops, retries and timeouts round it go
    on if they were under way, else they begin; a for_each has its item in place.

    Args:
        tree: The same tree, built anew; its ports hold the state's values.
        state: What `tree_state` gave; may have been taken anywhere in the mission.
        path: Of the node.
    """
    nodes = _by_path(tree)
    for other, node in nodes.items():
        _set_node(node, state["nodes"][other], nodes)
    chain = [*reversed(list(_ancestors(nodes[path]))), nodes[path]]
    for above, below in itertools.pairwise(chain):
        if isinstance(above, MissionDecorator):
            above.enter()
        elif above.status is not Status.RUNNING:
            above.initialise()
        if isinstance(above, Composite):
            before = Status.FAILURE if isinstance(above, py_trees.composites.Selector) else Status.SUCCESS
            for child in above.children[: above.children.index(below)]:
                child.status = before
            for child in above.children[above.children.index(below) + 1 :]:
                child.status = Status.INVALID
            above.current_child = below
        above.status = Status.RUNNING
    for node in nodes[path].iterate():
        node.status = Status.INVALID


def _by_path(tree: BuiltTree) -> dict[str, Behaviour]:
    return {tree.paths[n.id]: n for n in tree.root.iterate()}


def _ancestors(node: Behaviour) -> Iterator[Behaviour]:
    above = node.parent
    while above is not None:
        yield above
        above = above.parent


def _set_node(node: Behaviour, state: Mapping[str, Any], nodes: Mapping[str, Behaviour]) -> None:
    status = Status(state["status"])
    # A skill that was under way starts from its beginning: to py_trees that is a node without a status.
    node.status = Status.INVALID if isinstance(node, Skill) and status is Status.RUNNING else status
    node.feedback_message = state.get("feedback", "")
    if isinstance(node, Composite):
        node.current_child = nodes[state["child"]] if "child" in state else None
    if isinstance(node, MissionDecorator):
        node.progress = state["progress"]
    if hasattr(node, "reason"):
        node.reason = state.get("reason")
    if isinstance(node, Skill) and "remembered" in state:
        node.recall(state["remembered"])
