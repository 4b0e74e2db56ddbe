"""The base of nodes that run their child again and again, up to a limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from glotouch_bt.mission.nodes.base.analysis import DataFlowAnalysis, ExitStates, PathSearch, Position, Stack, Values
from glotouch_bt.mission.nodes.base.kind import NodeKind
from glotouch_bt.mission.nodes.base.run_count import RunCount
from glotouch_bt.mission.nodes.base.state_sets import EMPTY
from glotouch_bt.mission.spec import NodeSpec

MAX_PASSES_FOLLOWED = 3
"""Number of passes that a path search follows one by one. A loop that allows more may be left as if the rest had gone
alike."""


@dataclass(frozen=True)
class Pass:
    """Sets of states after one pass of a loop.

    Attributes:
        again: Another pass follows.
        success, failure: The loop ends so.
        running: It may be preempted.
    """

    again: int = EMPTY
    success: int = EMPTY
    failure: int = EMPTY
    running: int = EMPTY


class LoopKind(NodeKind):
    """Run the child again while it ends with `repeat_on`.

    Attributes:
        repeat_on: The result of the child after which it runs again: True for success.
    """

    revisits = True
    repeat_on: ClassVar[bool]

    def max_passes(self, node: NodeSpec) -> int:
        """Return the limit of the number of passes."""
        raise NotImplementedError

    def exhausted(self, node: NodeSpec) -> bool:
        """Return True if the loop succeeds when `max_passes` have been made (default: as its last pass ends)."""
        return self.repeat_on

    def once(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> Pass:
        """Return the states after one pass that begins in `entry`."""
        after = flow.child(node, entry)
        if self.repeat_on:
            return Pass(again=after.success, failure=after.failure, running=after.running)
        return Pass(again=after.failure, success=after.success, running=after.running)

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Follow the loop pass by pass until its states come back."""
        limit, union = self.max_passes(node), flow.sets.union
        passes, last = _follow(entry, limit, lambda e: self.once(flow, node, e))
        ends = {True: union(*(p.success for p in passes)), False: union(*(p.failure for p in passes))}
        result = self.exhausted(node)
        ends[result] = union(ends[result], last.again)
        between = [p.again for p in passes[: limit - 1]] if flow.preemptible(node) else []
        return ExitStates(ends[True], ends[False], union(*between, *(p.running for p in passes)))

    def memory(self, values: Values) -> Any:
        """Return the number of the pass, and the values it began with."""
        return 1, values

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Enter the child again, or end."""
        if succeeded != self.repeat_on:
            yield from search.leave(stack, succeeded, values)
        else:
            yield from self.after_iteration(search, node, stack, values, memory)

    def after_iteration(
        self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Enter the child again, unless the passes are used up."""
        (passes, began), limit, last = memory, self.max_passes(node), self.exhausted(node)
        if passes >= limit:
            yield from search.leave(stack, last, values)
            return
        following = min(passes + 1, MAX_PASSES_FOLLOWED + 1) if limit > MAX_PASSES_FOLLOWED + 1 else passes + 1
        yield from search.enter(node.children[0], search.push(stack, node, (following, values)), values)
        if limit > MAX_PASSES_FOLLOWED and values == began:
            for at in search.leave(stack, last, values):
                yield replace(at, said=at.said or f"{node.name} gives up after {limit} passes")

    def max_runs(self, node: NodeSpec) -> RunCount:
        """Return the child's number, times the limit."""
        below = super().max_runs(node)
        return below.times(self.max_passes(node))

    def catches_failure(self, node: NodeSpec) -> bool:
        """True if it runs again after a failure."""
        return not self.repeat_on


def _follow(entry: int, limit: int, once: Callable[[int], Pass]) -> tuple[list[Pass], Pass]:
    """Return each pass that differs from those before, and pass number `limit` (empty if it is never made)."""
    passes: list[Pass] = []
    first: dict[int, int] = {}
    while entry != EMPTY and len(passes) < limit:
        if entry in first:
            start = first[entry]
            return passes, passes[start + (limit - 1 - start) % (len(passes) - start)]
        first[entry] = len(passes)
        passes.append(once(entry))
        entry = passes[-1].again
    return passes, passes[-1] if len(passes) == limit else Pass()
