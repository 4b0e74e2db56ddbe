"""Save the state of a tree at the moment a skill ends, and restore a newly built tree to it.

The moment lies inside a tick: the skill has ended, its parent has not reacted, and the next skill has not started. In
its first tick the restored tree reports the end of that skill once more, and of every node that had ended earlier in
the same tick. It then continues exactly as the first tree did. A skill that ran in parallel starts again.
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
    """Return the state of a tree inside a tick.

    Args:
        tree: The tree.
        finished: The nodes that have ended in this tick so far, in order; the last one has just ended.
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
    if isinstance(node, Skill) and (remembered := node.remember()) is not None:
        state["remembered"] = remembered
    return state


class RestoredTree:
    """A newly built tree restored to a saved state. Tick it once, then call `done`.

    Args:
        tree: The same tree, built anew.
        state: Result of `tree_state`.

    Raises:
        BadInput: The state is of another tree.
    """

    def __init__(self, tree: BuiltTree, state: Mapping[str, Any]) -> None:
        self._replayed: list[Behaviour] = []
        nodes = _by_path(tree)
        if state["nodes"].keys() != nodes.keys():
            odd = ", ".join(sorted(state["nodes"].keys() ^ nodes.keys())[:3])
            raise BadInput(f"the checkpoint is of another tree (nodes that are not in both: {odd})")
        for path, node in nodes.items():
            _set_node(node, state["nodes"][path], nodes)
        for path in state["finished"]:
            self._replay_end(nodes[path])
        if state["finished"]:
            ended = nodes[state["finished"][-1]]
            for node in (ended, *_ancestors(ended)):
                node.status = Status.RUNNING

    def replays(self, node: Behaviour) -> bool:
        """Return True if the node's end was reported before the checkpoint."""
        return node in self._replayed

    def done(self) -> None:
        """End the replay after the first tick."""
        for node in self._replayed:
            vars(node).pop("tick", None)
        self._replayed = []

    def _replay_end(self, node: Behaviour) -> None:
        """Let the node report its final status in its next tick instead of running."""
        final = node.status
        if final not in (Status.SUCCESS, Status.FAILURE):  # preempted by a node that ended later in the tick
            return

        def tick() -> Iterator[Behaviour]:
            vars(node).pop("tick", None)
            node.status = final
            yield node

        node.tick = tick
        self._replayed.append(node)


def start_at(tree: BuiltTree, state: Mapping[str, Any], path: str) -> None:
    """Prepare a newly built tree to start at a given node.

    Earlier siblings count as succeeded in a sequence and as failed in a selector. Enclosing loops, retries and timeouts
    continue if they were running, otherwise they start; a for_each sets its item.

    Args:
        tree: The same tree, built anew; its ports hold the saved values.
        state: Result of `tree_state`, taken anywhere in the mission.
        path: Path of the node.
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
    # A running skill starts again: to py_trees a node with status INVALID.
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
