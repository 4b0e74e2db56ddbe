"""The shortest run, as outcomes of leaves, that brings a tree to a node in a configuration that is wrong there.

A breadth-first search over the executions of the tree, one leaf's outcome a step. It follows only the variables that
can change the way there: the wrong one, and those that some node looks at and does not always find alike; for all
others the sets of the analysis say what is met. Loops need not be counted to their ends: a pass that comes back to
where it began may stand for all that are left. The children of a parallel are taken one after the other, in each order.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import permutations, product
from typing import Any

from glotouch_bt.mission.check.data_flow import Flow
from glotouch_bt.mission.check.live_variables import deciding, living
from glotouch_bt.mission.check.requirements import until_condition, verdicts
from glotouch_bt.mission.check.state_sets import EMPTY
from glotouch_bt.mission.check.state_variables import UNSET, gathered_kind, item_kind, written_kind
from glotouch_bt.mission.spec import (
    ConditionSettings,
    ForEachSettings,
    NodeSpec,
    ParallelSettings,
    RepeatSettings,
    RetrySettings,
)
from glotouch_bt.skill import UNCHANGED

MAX_STATES, MAX_STEPS = 30_000, 120_000
"""A search that sees more states gives up, and so do all searches of a check that have taken the second together, some
2 s: the finding then stands without a path."""
OUT_OF_PATIENCE = 3
"""Passes that are followed one by one; a loop that allows more may be left as if the rest had gone alike."""

Values = tuple[int, ...]
Frames = tuple[tuple[int, Any], ...]


@dataclass(frozen=True)
class Goal:
    """What to reach.

    Attributes:
        node: The node that looks, or None: the end of the mission, in success.
        port: Of the demand, or empty.
        variable: What it looks at.
        wrong: The values it must not find.
    """

    node: NodeSpec | None
    port: str
    variable: int
    wrong: frozenset[int]


@dataclass(frozen=True)
class _At:
    """A place in an execution: the nodes being run, outermost first, with what they remember; the leaf is the last.

    `done`: the goal, or the end, is reached. `said`: what happened on the way here beside the leaf's outcome.
    """

    frames: Frames
    values: Values
    done: str = ""
    said: str = field(default="", compare=False)


@dataclass
class Patience:
    """How many steps, seen states or new ones, the searches of one check may still take together."""

    steps: int = MAX_STEPS


def shortest_path(flow: Flow, goal: Goal, patience: Patience | None = None) -> tuple[str, ...]:
    """Outcomes of leaves on the shortest way to a goal, the node that looks last; empty if none was found.

    `patience` is used up by the steps of the search.
    """
    patience = patience or Patience()
    return _Search(flow, goal).run(patience) if patience.steps > 0 else ()


class _Search:
    def __init__(self, flow: Flow, goal: Goal) -> None:
        self._flow, self._goal = flow, goal
        self._variables, self._sets = flow.variables, flow.variables.sets
        self._nodes = list(flow.tree.walk())
        self._number = {id(n): i for i, n in enumerate(self._nodes)}
        followed = dict.fromkeys([goal.variable, *deciding(flow)])
        self._index = {v: i for i, v in enumerate(followed)}
        lasting = goal.variable if goal.node is None else None
        self._alive = living(flow, self._nodes, self._index, lasting)

    def run(self, patience: Patience) -> tuple[str, ...]:
        first = tuple(0 for _ in self._index)
        came: dict[_At, tuple[_At | None, str]] = {}
        queue: deque[_At] = deque()

        def see(at: _At, before: _At | None, label: str) -> _At | None:
            patience.steps -= 1
            if at.frames:
                alive = self._alive[at.frames[-1][0]]
                at = replace(at, values=tuple(v if i in alive else 0 for i, v in enumerate(at.values)))
            if at in came:
                return None
            came[at] = (before, label)
            queue.append(at)
            return at if at.done == "goal" else None

        for at in self._enter(self._flow.tree, (), first):
            if found := see(at, None, ""):
                return self._told(found, came)
        while queue and len(came) < MAX_STATES and patience.steps > 0:
            here = queue.popleft()
            if here.done:
                continue
            for label, there in self._step(here):
                if found := see(there, here, label):
                    return self._told(found, came)
        return ()

    def _told(self, at: _At, came: dict[_At, tuple[_At | None, str]]) -> tuple[str, ...]:
        words: list[str] = []
        here: _At | None = at
        while here is not None:
            before, label = came[here]
            words += [w for w in (here.said, label) if w]
            here = before
        words.reverse()
        words.append("the mission ends" if self._goal.node is None else self._goal.node.name)
        return tuple(words)

    # -- values ------------------------------------------------------------------------------------------------------

    def _value(self, values: Values, variable: int) -> int | None:
        """The value of a variable that is followed, or None."""
        index = self._index.get(variable)
        return None if index is None else values[index]

    def _with(self, values: Values, variable: int, value: int) -> Values:
        index = self._index.get(variable)
        return values if index is None else (*values[:index], value, *values[index + 1 :])

    def _looked(self, node: NodeSpec, values: Values, port: str) -> bool:
        """The goal is reached by this look."""
        goal = self._goal
        return goal.node is node and goal.port == port and self._value(values, goal.variable) in goal.wrong

    def _compared(self, node: NodeSpec, port: str, settings: ConditionSettings, values: Values) -> list[bool]:
        """What a comparison may say."""
        demand = next(d for d in self._flow.demands[id(node)] if d.port == port)
        value = self._value(values, demand.variable)
        asked = self._flow.asked.get(demand, EMPTY)
        found = {value} if value is not None else set(self._sets.values(asked, demand.variable))
        yes, no = verdicts(self._variables, demand, settings)
        return [said for said, which in ((True, yes), (False, no)) if found & which]

    # -- into and out of nodes ---------------------------------------------------------------------------------------

    def _enter(self, node: NodeSpec, above: Frames, values: Values) -> Iterator[_At]:
        here, kind = self._number[id(node)], node.kind
        if not node.children:
            yield _At((*above, (here, None)), values)
        elif kind == "for_each" and "items" in node.reads and "item" in node.writes:
            if self._looked(node, values, "items"):
                yield _At((), values, "goal")
                return
            yield from self._enter_for_each(node, above, values)
        elif kind == "parallel":
            for order in permutations(range(len(node.children))) if len(node.children) <= 3 else _turns(node):
                yield from self._enter(node.children[order[0]], (*above, (here, (order, 0))), values)
        else:
            remembered = {"sequence": 0, "selector": 0, "retry": (1, values), "repeat": (1, values)}.get(kind)
            yield from self._enter(node.children[0], (*above, (here, remembered)), values)

    def _leave(self, frames: Frames, good: bool, values: Values) -> Iterator[_At]:
        """On from a finished node below `frames`."""
        if not frames:
            goal = self._goal
            wrong = good and goal.node is None and self._value(values, goal.variable) in goal.wrong
            yield _At((), values, "goal" if wrong else "end")
            return
        above, (number, memory) = frames[:-1], frames[-1]
        node = self._nodes[number]
        if node.kind in ("sequence", "selector"):
            if good == (node.kind == "sequence") and memory + 1 < len(node.children):
                yield from self._enter(node.children[memory + 1], (*above, (number, memory + 1)), values)
            else:
                yield from self._leave(above, good, values)
        elif node.kind == "invert":
            yield from self._leave(above, not good, values)
        elif node.kind in ("succeed", "fail"):
            yield from self._leave(above, node.kind == "succeed", values)
        elif node.kind == "retry":
            limit = node.settings.attempts if isinstance(node.settings, RetrySettings) else 1
            yield from self._leave_loop(node, above, good, values, memory, limit, again_when=False)
        elif node.kind == "repeat":
            yield from self._leave_repeat(node, above, good, values, memory)
        elif node.kind == "parallel":
            yield from self._leave_parallel(node, above, good, values, memory)
        elif node.kind == "for_each" and memory is not None:
            yield from self._leave_for_each(node, above, good, values, memory)
        else:
            yield from self._leave(above, good, values)

    def _leave_loop(
        self,
        node: NodeSpec,
        above: Frames,
        good: bool,
        values: Values,
        memory: tuple[int, Values],
        limit: int,
        *,
        again_when: bool,
        out_of: bool | None = None,
    ) -> Iterator[_At]:
        """After a pass: once more while it ends with `again_when`; what it says in the end is `out_of`."""
        passes, began = memory
        last = good if out_of is None else out_of
        if good != again_when or passes >= limit:
            yield from self._leave(above, good if good != again_when else last, values)
            return
        following = min(passes + 1, OUT_OF_PATIENCE + 1) if limit > OUT_OF_PATIENCE + 1 else passes + 1
        number = self._number[id(node)]
        yield from self._enter(node.children[0], (*above, (number, (following, values))), values)
        if limit > OUT_OF_PATIENCE and values == began:
            for at in self._leave(above, last, values):
                yield replace(at, said=at.said or f"{node.name} gives up after {limit} passes")

    def _leave_repeat(
        self, node: NodeSpec, above: Frames, good: bool, values: Values, memory: tuple[int, Values]
    ) -> Iterator[_At]:
        settings = node.settings if isinstance(node.settings, RepeatSettings) else RepeatSettings(times=1)
        if settings.until is None or "until" not in node.reads:
            yield from self._leave_loop(node, above, good, values, memory, settings.times or 1, again_when=True)
            return
        if not good:
            yield from self._leave(above, False, values)
            return
        if self._looked(node, values, "until"):
            yield _At((), values, "goal")
            return
        for holds in self._compared(node, "until", until_condition(settings), values):
            if holds:
                yield from self._leave(above, True, values)
            else:
                yield from self._leave_loop(
                    node, above, True, values, memory, settings.limit, again_when=True, out_of=False
                )

    def _leave_parallel(self, node: NodeSpec, above: Frames, good: bool, values: Values, memory: Any) -> Iterator[_At]:
        order, i = memory
        one = isinstance(node.settings, ParallelSettings) and node.settings.policy == "one"
        if not good:  # the others are broken off
            yield from self._leave(above, False, values)
        elif i + 1 < len(order):
            if one:
                yield from self._leave(above, True, values)
            following = (self._number[id(node)], (order, i + 1))
            yield from self._enter(node.children[order[i + 1]], (*above, following), values)
        else:
            yield from self._leave(above, True, values)

    def _enter_for_each(self, node: NodeSpec, above: Frames, values: Values) -> Iterator[_At]:
        items = self._variables.keys[node.reads["items"].key]
        value = self._value(values, items)
        asked = next((s for d, s in self._flow.asked.items() if d.node is node and d.port == "items"), EMPTY)
        found = {value} if value is not None else set(self._sets.values(asked, items))
        cleared = values
        for port, target in node.writes.items():
            if port in node.reads:
                source = node.reads[port].key
                held = [self._variables.kind(source, v) for v in self._variables.written(source)][1:]
                made = self._variables.value(target.key, gathered_kind(dict.fromkeys(held)))
                cleared = self._with(cleared, self._variables.keys[target.key], made)
        # No pass without a step: a loop round an empty for_each would never come to a leaf.
        here, kinds = self._number[id(node)], sorted(found - {UNSET})
        if UNSET in found:
            yield _At((*above, (here, False)), cleared)
        if kinds:
            yield _At((*above, (here, True)), cleared)
        for items_kind in kinds:
            yield from self._next_item(node, above, cleared, items_kind, False)

    def _next_item(self, node: NodeSpec, above: Frames, values: Values, items_kind: int, won: bool) -> Iterator[_At]:
        for port in node.writes:
            if port in node.reads:
                values = self._with(values, self._variables.keys[node.reads[port].key], UNSET)
        item = node.writes["item"].key
        kind = item_kind(self._variables.kind(node.reads["items"].key, items_kind))
        values = self._with(values, self._variables.keys[item], self._variables.value(item, kind))
        frame = (self._number[id(node)], (items_kind, won))
        yield from self._enter(node.children[0], (*above, frame), values)

    def _leave_for_each(self, node: NodeSpec, above: Frames, good: bool, values: Values, memory: Any) -> Iterator[_At]:
        items_kind, won = memory
        go_on = isinstance(node.settings, ForEachSettings) and node.settings.on_failure == "continue"
        if not good and not go_on:
            yield from self._leave(above, False, values)
            return
        if good:
            if any(self._looked(node, values, p) for p in node.reads if p != "items"):
                yield _At((), values, "goal")
                return
            values = self._gathered(node, values)
        yield from self._leave(above, good or won, values)
        yield from self._next_item(node, above, values, items_kind, good or won)

    def _gathered(self, node: NodeSpec, values: Values) -> Values:
        pairs = [(node.reads[p].key, w.key) for p, w in node.writes.items() if p in node.reads]
        found = {s: self._value(values, self._variables.keys[s]) for s, _ in pairs}
        if UNSET in found.values():
            return values
        for source, target in pairs:
            value = found[source]
            if value is not None:
                kind = gathered_kind({self._variables.kind(source, value): None})
                values = self._with(values, self._variables.keys[target], self._variables.value(target, kind))
        return values

    # -- leaves ------------------------------------------------------------------------------------------------------

    def _step(self, at: _At) -> Iterator[tuple[str, _At]]:
        above, node = at.frames[:-1], self._nodes[at.frames[-1][0]]
        goal, values = self._goal, at.values
        if goal.node is node and any(self._looked(node, values, d.port) for d in self._flow.demands[id(node)]):
            yield "", _At((), values, "goal")
            return
        if node.kind == "for_each" and node.children:
            good = bool(at.frames[-1][1])
            for there in self._leave(above, good, values):
                yield f"{node.name} has {'no item' if good else 'nothing to go through'}", there
            return
        if node.kind == "condition" and "port" in node.reads and isinstance(node.settings, ConditionSettings):
            for holds in self._compared(node, "port", node.settings, values):
                for there in self._leave(above, holds, values):
                    yield f"{node.name} {'holds' if holds else 'does not hold'}", there
            return
        if node.skill_type is None:
            return  # nobody knows what follows
        for demand in self._flow.demands[id(node)]:
            value = self._value(values, demand.variable)
            if value is not None and value not in demand.good:
                return
        for made in self._ended(node, values, "success"):
            for there in self._leave(above, True, made):
                yield f"{node.name} ok", there
        for made in self._ended(node, values, "failure"):
            for there in self._leave(above, False, made):
                yield f"{node.name} fails", there
        limits = [i for i, (n, _) in enumerate(above) if self._nodes[n].kind == "timeout"]
        for i in limits:
            for made in self._ended(node, values, "running"):
                for there in self._leave(above[:i], False, made):
                    yield f"{node.name} is broken off by {self._nodes[above[i][0]].name}", there

    def _ended(self, node: NodeSpec, values: Values, how: str) -> Iterator[Values]:
        """The values a skill may leave, those that change least first."""
        skill = node.skill_type
        assert skill is not None
        choices: list[list[tuple[int, int] | None]] = []
        for port, wire in node.writes.items():
            variable = self._variables.keys[wire.key]
            if variable in self._index:
                written = (variable, self._variables.value(wire.key, written_kind(node, port, how)))
                sure = how == "success" or (how == "failure" and getattr(getattr(skill, port), "always", False))
                choices.append([written] if sure else [None, written])
        for resource, variable in self._variables.resources.items():
            if variable not in self._index:
                continue
            leaves = skill.POSTCONDITIONS.get(resource)
            after = set(skill.FAILURE_STATES.get(resource, {UNCHANGED, leaves or UNCHANGED}))
            names = {leaves or UNCHANGED} if how == "success" else after
            if how == "running":
                names |= {UNCHANGED, leaves or UNCHANGED}
            kept: list[tuple[int, int] | None] = [None] if UNCHANGED in names else []
            changed = sorted(names - {UNCHANGED})
            choices.append([*kept, *((variable, self._variables.state(resource, n)) for n in changed)])
        for chosen in product(*choices):
            made = values
            for one in chosen:
                if one is not None:
                    made = self._with(made, *one)
            yield made


def _turns(node: NodeSpec) -> Iterator[tuple[int, ...]]:
    """Each child first, the others in order, forwards and backwards."""
    order = tuple(range(len(node.children)))
    for i in order:
        yield order[i:] + order[:i]
    yield order[::-1]
