"""`sequence` and `selector`: children in order until one fails, or until one succeeds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import py_trees
from py_trees.behaviour import Behaviour

from glotouch_bt.mission.nodes.base import (
    EMPTY,
    BuildContext,
    DataFlowAnalysis,
    ExitStates,
    NodeKind,
    PathSearch,
    Position,
    Stack,
    Values,
)
from glotouch_bt.mission.spec import NodeSpec


class OrderedKind(NodeKind):
    """Children in order, until one ends otherwise than `continue_on`."""

    children = "many"

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Follow the children in order."""
        ended = running = EMPTY
        for child in node.children:
            after = flow.run(child, entry)
            entry, other = (after.success, after.failure) if self.continue_on else (after.failure, after.success)
            ended = flow.sets.union(ended, other)
            running = flow.sets.union(running, after.running)
        return ExitStates(entry, ended, running) if self.continue_on else ExitStates(ended, entry, running)

    def memory(self, values: Values) -> Any:
        """Return the place of the first child."""
        return 0

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Enter the next child, or end."""
        if succeeded == self.continue_on and memory + 1 < len(node.children):
            yield from search.enter(node.children[memory + 1], search.push(stack, node, memory + 1), values)
        else:
            yield from search.leave(stack, succeeded, values)


class SequenceKind(OrderedKind):
    """Run the children in order; fail with the first that fails."""

    name = "sequence"
    description = "children in order; fails with the first that fails"
    btcpp, sign = "Sequence", "→"
    continue_on = True

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return a sequence that remembers its running child."""
        return py_trees.composites.Sequence(node.name, memory=True, children=children)


class SelectorKind(OrderedKind):
    """Run the children in order; succeed with the first that succeeds."""

    name = "selector"
    description = "children in order; succeeds with the first that succeeds"
    btcpp, sign = "Fallback", "?"
    continue_on = False

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return a selector that remembers its running child."""
        return py_trees.composites.Selector(node.name, memory=True, children=children)

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """One child is no alternative."""
        return "it has one child" if len(node.children) == 1 and not node.children[0].is_unread else ""

    def catches_failure(self, node: NodeSpec) -> bool:
        """The next child may succeed."""
        return True
