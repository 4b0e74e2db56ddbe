"""`parallel`: all children in every period."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import permutations
from typing import Any, Literal

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from pydantic import Field

from glotouch_bt.mission.nodes.base import (
    BtcppForm,
    BuildContext,
    DataFlowAnalysis,
    ExitStates,
    NodeKind,
    PathSearch,
    Position,
    Stack,
    Values,
    kind_of,
)
from glotouch_bt.mission.spec import NodeSpec, Settings


class ParallelSettings(Settings):
    """Tick all children in every period."""

    policy: Literal["all", "one"] = Field(default="all", description="succeed when all have, or when one has")


class ParallelKind(NodeKind):
    """Run all children at the same time; fail with the first that fails."""

    name = "parallel"
    description = "all children at once; fails with the first that fails"
    Settings = ParallelSettings
    children = "many"
    btcpp, sign = "Parallel", "⇉"
    concurrent = revisits = True

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Enter each child as if its siblings had done any part of what they do, and end as if they had."""
        sets, children = flow.sets, node.children
        effects = [self._effects(flow, c) for c in children]
        afters: list[ExitStates] = []
        for i, child in enumerate(children):
            others = [e for j, e in enumerate(effects) if j != i]
            after = flow.run(child, _disturbed(flow, entry, others))
            ends = (after.success, after.failure, after.running)
            afters.append(ExitStates(*(_disturbed(flow, s, others) for s in ends)))
        anyhow = [sets.union(a.success, a.failure, a.running) for a in afters]
        going = [sets.union(a.success, a.running) for a in afters]
        unfailed = going if self._one(node) else [a.success for a in afters]

        def met(chosen: int, others: list[int], i: int) -> int:
            for j, other in enumerate(others):
                chosen = chosen if j == i else sets.meet(chosen, other)
            return chosen

        success = sets.union(*(met(a.success, unfailed, i) for i, a in enumerate(afters)))
        failure = sets.union(*(met(a.failure, anyhow, i) for i, a in enumerate(afters)))
        running = sets.union(*(met(a.running, going, i) for i, a in enumerate(afters)))
        return ExitStates(success, failure, running)

    @staticmethod
    def _one(node: NodeSpec) -> bool:
        return isinstance(node.settings, ParallelSettings) and node.settings.policy == "one"

    @staticmethod
    def _effects(flow: DataFlowAnalysis, node: NodeSpec) -> dict[int, set[int]]:
        """Return the variables that a child and all below it may change, and to what."""
        effects: dict[int, set[int]] = {}
        for below in node.walk():
            for variable, values in kind_of(below).effects(below, flow.variables):
                effects.setdefault(variable, set()).update(values)
        return effects

    def enter(self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values) -> Iterator[Position]:
        """Take the children one after the other: in each order, or with each of them first if they are many."""
        for order in permutations(range(len(node.children))) if len(node.children) <= 3 else _turns(node):
            yield from search.enter(node.children[order[0]], search.push(stack, node, (order, 0)), values)

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Enter the next child; the first failure, or with policy `one` the first success, may end it."""
        order, i = memory
        if not succeeded or i + 1 == len(order):
            yield from search.leave(stack, succeeded, values)
            return
        if self._one(node):
            yield from search.leave(stack, True, values)
        yield from search.enter(node.children[order[i + 1]], search.push(stack, node, (order, i + 1)), values)

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """One child."""
        return "it has one child" if len(node.children) == 1 and not node.children[0].is_unread else ""

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return a parallel; with `all` a child that has succeeded is not ticked again."""
        policy = ParallelPolicy.SuccessOnOne() if self._one(node) else ParallelPolicy.SuccessOnAll(synchronise=True)
        return py_trees.composites.Parallel(node.name, policy=policy, children=children)

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it with its policy as counts."""
        return BtcppForm(self.btcpp, {"success_count": "1" if self._one(node) else "-1", "failure_count": "1"})


def _disturbed(flow: DataFlowAnalysis, entry: int, effects: Iterable[dict[int, set[int]]]) -> int:
    for effect in effects:
        for variable, values in effect.items():
            entry = flow.sets.allow(entry, variable, values)
    return entry


def _turns(node: NodeSpec) -> Iterator[tuple[int, ...]]:
    """Yield the orders with each child first, the others in turn, and the reverse order."""
    order = tuple(range(len(node.children)))
    for i in order:
        yield order[i:] + order[:i]
    yield order[::-1]
