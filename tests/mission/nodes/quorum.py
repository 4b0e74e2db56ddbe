"""A decorator that is not shipped: it shows that a new node kind is one file and one registration.

`quorum: {successes: 2, of: 3, do: NODE}` runs its child until it has succeeded often enough, or no longer can.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from pydantic import Field

from glotouch_bt.mission.nodes import BuildContext, ExitStates, MissionDecorator, NodeKind, Position, Stack, Values
from glotouch_bt.mission.nodes.base import DataFlowAnalysis, PathSearch, RunCount
from glotouch_bt.mission.spec import NodeSpec, Settings


class QuorumSettings(Settings):
    """Run the child several times; enough of its passes must succeed."""

    successes: int = Field(description="number of passes that must succeed", ge=1, le=100)
    of: int = Field(description="number of passes", ge=1, le=100)

    def result(self, passes: int, successes: int) -> bool | None:
        """Return the result after some passes; None while it is open."""
        if successes >= self.successes:
            return True
        return False if self.successes - successes > self.of - passes else None


class Quorum(MissionDecorator):
    """Counts passes and successes."""

    kept = ("_passes", "_successes")

    def __init__(self, name: str, child: Behaviour, settings: QuorumSettings) -> None:
        super().__init__(name, child)
        self._settings, self._passes, self._successes = settings, 0, 0

    def initialise(self) -> None:
        super().initialise()
        self._passes = self._successes = 0

    def update(self) -> Status:
        if self.decorated.status is Status.RUNNING:
            return Status.RUNNING
        self._passes += 1
        self._successes += self.decorated.status is Status.SUCCESS
        result = self._settings.result(self._passes, self._successes)
        if result is None:
            return Status.RUNNING
        if result:
            return Status.SUCCESS
        return self.fail("no_quorum", f"{self._successes} of {self._passes} passes succeeded", passes=self._passes)


class QuorumKind(NodeKind):
    """Run the child until enough passes have succeeded."""

    name = "quorum"
    description = "enough of several passes of the child must succeed"
    Settings = QuorumSettings
    revisits = needs_settings = True

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        assert isinstance(node.settings, QuorumSettings)
        union, ends, running, following = flow.sets.union, {True: 0, False: 0}, 0, {0: entry}
        for passes in range(1, node.settings.of + 1):
            begun, following = following, {}
            for successes, states in begun.items():
                after = flow.child(node, states)
                running = union(running, after.running)
                for counted, left in ((successes + 1, after.success), (successes, after.failure)):
                    result = node.settings.result(passes, counted)
                    if result is None:
                        following[counted] = union(following.get(counted, 0), left)
                        running = union(running, left)
                    else:
                        ends[result] = union(ends[result], left)
        return ExitStates(ends[True], ends[False], running)

    def memory(self, values: Values) -> Any:
        return 0, 0

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        assert isinstance(node.settings, QuorumSettings)
        passes, successes = memory[0] + 1, memory[1] + succeeded
        result = node.settings.result(passes, successes)
        if result is None:
            yield from search.enter(node.children[0], search.push(stack, node, (passes, successes)), values)
        else:
            yield from search.leave(stack, result, values)

    def max_runs(self, node: NodeSpec) -> RunCount:
        below = super().max_runs(node)
        return below.times(node.settings.of) if isinstance(node.settings, QuorumSettings) else below

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        once = isinstance(node.settings, QuorumSettings) and node.settings.of == 1
        return "one pass is no quorum" if once else ""

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        assert isinstance(node.settings, QuorumSettings)
        return Quorum(node.name, children[0], node.settings)
