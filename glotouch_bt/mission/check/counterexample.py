"""The shortest run, as outcomes of leaves, that brings a tree to a node in a state that is wrong there.

A breadth-first search over the executions of the tree, one leaf's outcome a step. It follows only the wrong variable
and those that can change the course of a run (`live_variables`); for all others it uses the sets of the analysis. Loops
need not be counted to their ends: a pass that comes back to the state it began in may stand for all that are left. The
children of a parallel are taken one after the other, in each order.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from glotouch_bt.mission.check.data_flow import DataFlow
from glotouch_bt.mission.check.live_variables import deciding, living
from glotouch_bt.mission.check.requirements import verdicts
from glotouch_bt.mission.nodes import ConditionSettings, Position, Stack, Values, kind_of
from glotouch_bt.mission.spec import NodeSpec

MAX_STATES = 30_000
"""A search that sees more states gives up; the finding then has no path."""
MAX_STEPS = 120_000
"""All searches of one check give up after this many steps together, about 2 s."""


@dataclass(frozen=True)
class Goal:
    """Goal of a path search.

    Attributes:
        node: The node that looks, or None: the end of the mission, in success.
        port: Of the requirement, or empty.
        variable: The variable it looks at.
        wrong: The values it must not find.
    """

    node: NodeSpec | None
    port: str
    variable: int
    wrong: frozenset[int]


@dataclass
class StepBudget:
    """Number of steps that the searches of one check may still take together."""

    steps: int = MAX_STEPS


def shortest_path(flow: DataFlow, goal: Goal, budget: StepBudget | None = None) -> tuple[str, ...]:
    """Return the outcomes of leaves on the shortest way to a goal, the node that looks last; empty if none was found.

    The steps of the search are taken from `budget`.
    """
    budget = budget or StepBudget()
    return _ShortestPath(flow, goal).run(budget) if budget.steps > 0 else ()


class _ShortestPath:
    def __init__(self, flow: DataFlow, goal: Goal) -> None:
        self._flow, self._goal = flow, goal
        self.variables = flow.variables
        self._nodes = list(flow.tree.walk())
        self._number = {id(n): i for i, n in enumerate(self._nodes)}
        followed = dict.fromkeys([goal.variable, *deciding(flow)])
        self._index = {v: i for i, v in enumerate(followed)}
        lasting = goal.variable if goal.node is None else None
        self._alive = living(flow, self._nodes, self._index, lasting)

    def run(self, budget: StepBudget) -> tuple[str, ...]:
        first = tuple(0 for _ in self._index)
        came: dict[Position, tuple[Position | None, str]] = {}
        queue: deque[Position] = deque()

        def see(at: Position, before: Position | None, label: str) -> Position | None:
            budget.steps -= 1
            if at.stack:
                alive = self._alive[at.stack[-1][0]]
                at = replace(at, values=tuple(v if i in alive else 0 for i, v in enumerate(at.values)))
            if at in came:
                return None
            came[at] = (before, label)
            queue.append(at)
            return at if at.done == "goal" else None

        for at in self.enter(self._flow.tree, (), first):
            if found := see(at, None, ""):
                return self._words(found, came)
        while queue and len(came) < MAX_STATES and budget.steps > 0:
            here = queue.popleft()
            if here.done:
                continue
            for label, there in self._step(here):
                if found := see(there, here, label):
                    return self._words(found, came)
        return ()

    def _words(self, at: Position, came: dict[Position, tuple[Position | None, str]]) -> tuple[str, ...]:
        words: list[str] = []
        here: Position | None = at
        while here is not None:
            before, label = came[here]
            words += [w for w in (here.said, label) if w]
            here = before
        words.reverse()
        words.append("the mission ends" if self._goal.node is None else self._goal.node.name)
        return tuple(words)

    def _step(self, at: Position) -> Iterator[tuple[str, Position]]:
        stack, (number, memory) = at.stack[:-1], at.stack[-1]
        node = self._nodes[number]
        if any(self.reached(node, r.port, at.values) for r in self._flow.requirements[id(node)]):
            yield "", Position((), at.values, "goal")
            return
        yield from kind_of(node).step(self, node, stack, at.values, memory)

    # -- for node kinds ------------------------------------------------------------------------------------------------

    def enter(self, node: NodeSpec, stack: Stack, values: Values) -> Iterator[Position]:
        """Enter a node below `stack`."""
        yield from kind_of(node).enter(self, node, stack, values)

    def leave(self, stack: Stack, succeeded: bool, values: Values) -> Iterator[Position]:
        """Continue in the innermost node of `stack`, whose child has just ended."""
        if not stack:
            goal = self._goal
            wrong = succeeded and goal.node is None and self.followed(values, goal.variable) in goal.wrong
            yield Position((), values, "goal" if wrong else "end")
            return
        above, (number, memory) = stack[:-1], stack[-1]
        node = self._nodes[number]
        yield from kind_of(node).leave(self, node, above, succeeded, values, memory)

    def push(self, stack: Stack, node: NodeSpec, memory: Any) -> Stack:
        """Return the stack with a node and what it remembers on top."""
        return (*stack, (self._number[id(node)], memory))

    def reached(self, node: NodeSpec, port: str, values: Values) -> bool:
        """Return True if this read of a port is the goal."""
        goal = self._goal
        return goal.node is node and goal.port == port and self.followed(values, goal.variable) in goal.wrong

    def verdicts(self, node: NodeSpec, port: str, settings: ConditionSettings, values: Values) -> list[bool]:
        """Return the possible results of a comparison."""
        requirement = next(r for r in self._flow.requirements[id(node)] if r.port == port)
        found = self.may_hold(node, port, values)
        yes, no = verdicts(self.variables, requirement, settings)
        return [said for said, which in ((True, yes), (False, no)) if found & which]

    def may_hold(self, node: NodeSpec, port: str, values: Values) -> set[int]:
        """Return the values that a port may hold: the one followed, or all that the analysis knows."""
        requirement = next(r for r in self._flow.requirements[id(node)] if r.port == port)
        value = self.followed(values, requirement.variable)
        if value is not None:
            return {value}
        return set(self._flow.values(requirement))

    def followed(self, values: Values, variable: int) -> int | None:
        """Return the value of a variable; None if the search does not follow it."""
        index = self._index.get(variable)
        return None if index is None else values[index]

    def follows(self, variable: int) -> bool:
        """Return True if the search follows a variable."""
        return variable in self._index

    def assign(self, values: Values, variable: int, value: int) -> Values:
        """Return the values with a variable set, if it is followed."""
        index = self._index.get(variable)
        return values if index is None else (*values[:index], value, *values[index + 1 :])

    def meets(self, node: NodeSpec, values: Values) -> bool:
        """Return True if no variable that is followed breaks a requirement of a node."""
        found = ((self.followed(values, r.variable), r.good) for r in self._flow.requirements[id(node)])
        return all(value is None or value in good for value, good in found)

    def interrupters(self, stack: Stack) -> Iterator[tuple[Stack, NodeSpec]]:
        """Yield (stack above it, node) of every running node that may preempt its child at any moment."""
        for i, (number, _) in enumerate(stack):
            node = self._nodes[number]
            if kind_of(node).interrupts:
                yield stack[:i], node
