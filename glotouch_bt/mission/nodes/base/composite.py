"""The base of nodes that run their children in order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from glotouch_bt.mission.nodes.base.analysis import (
    EMPTY,
    DataFlowAnalysis,
    ExitStates,
    PathSearch,
    Position,
    Stack,
    Values,
)
from glotouch_bt.mission.nodes.base.kind import NodeKind
from glotouch_bt.mission.spec import NodeSpec


class CompositeKind(NodeKind):
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
