"""Every configuration in which each node of a tree can be entered, over all outcomes of all leaves: before it moves.

A node turns the set of configurations it is entered in into three: after its success, after its failure, and at any
moment at which it may be broken off while it runs. A skill may do each of these in any configuration; a condition
succeeds or fails freely on what is written and fails on what is not. The sets are exact for this model: nothing is
joined that differs, so a key written together with another is known to be (`succeed: a`, then a condition on one output
of `a`, makes all of them sure). Loops are followed pass by pass until their sets come back, then counted on; only in a
`parallel` are sets larger than need be, for its children's interleavings are not followed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from glotouch_bt.mission.check.exit_states import After
from glotouch_bt.mission.check.requirements import Demand, Demands, until_condition, verdicts
from glotouch_bt.mission.check.state_sets import EMPTY
from glotouch_bt.mission.check.state_variables import (
    ANYTHING,
    UNSET,
    Kind,
    Variables,
    gathered_kind,
    item_kind,
    written_kind,
    written_kinds,
)
from glotouch_bt.mission.spec import (
    ConditionSettings,
    ForEachSettings,
    NodeSpec,
    ParallelSettings,
    RepeatSettings,
    RetrySettings,
)
from glotouch_bt.skill import UNCHANGED

HOW = ("success", "failure", "running")


class Flow:
    """One evaluation of a tree.

    Args:
        tree: Its root.
        variables: Of the tree.
        demands: Of its nodes.
        lenient: Where a demand is met by no configuration at all, go on as if all met it: for what lies behind a
            mistake. Otherwise nothing goes on behind it, as in a run.

    Attributes:
        entered: Set in which each node was entered, by node id.
        left: What each node was left in, by node id.
        asked: Set in which each demand was made.
        end: After the root.
    """

    def __init__(self, tree: NodeSpec, variables: Variables, demands: Demands, *, lenient: bool = False) -> None:
        self.tree, self.variables, self.demands, self._lenient = tree, variables, demands, lenient
        self._sets = variables.sets
        self._has_unknown = any(n.kind == "unknown" or _is_faulty_loop(n) for n in tree.walk())
        self.entered: dict[int, int] = {}
        self.left: dict[int, After] = {}
        self.asked: dict[Demand, int] = {}
        self._known: dict[tuple[int, int], After] = {}
        self.end = self.run(tree, variables.start)

    def run(self, node: NodeSpec, entry: int) -> After:
        """After a node that is entered in `entry`."""
        if entry == EMPTY:
            return After()
        key = (id(node), entry)
        if key not in self._known:
            self.entered[id(node)] = self._sets.union(self.entered.get(id(node), EMPTY), entry)
            kind = "faulty_loop" if _is_faulty_loop(node) else node.kind
            method: Callable[[NodeSpec, int], After] | None = getattr(self, f"_of_{kind}", None)
            made = self._known[key] = method(node, entry) if method else self._nobody_knows(entry)
            self.left[id(node)] = self.left.get(id(node), After()).joined(made, self._sets)
        return self._known[key]

    # -- demands -----------------------------------------------------------------------------------------------------

    def judged(self, demand: Demand) -> int:
        """The set in which a demand was made, without what follows a node nobody knows."""
        asked = self.asked.get(demand, EMPTY)
        return self._sets.where(asked, self.variables.lost, (0,)) if self._has_unknown else asked

    def _ask(self, node: NodeSpec, port: str, entry: int) -> Demand | None:
        found = next((d for d in self.demands[id(node)] if d.port == port), None)
        if found is not None:
            self.asked[found] = self._sets.union(self.asked.get(found, EMPTY), entry)
        return found

    def _where(self, entry: int, variable: int, values: Iterable[int]) -> int:
        """Those with such a value; all of those that follow a node nobody knows."""
        found = self._sets.where(entry, variable, values)
        if not self._has_unknown:
            return found
        return self._sets.union(found, self._sets.where(entry, self.variables.lost, (1,)))

    def _meeting(self, entry: int, demand: Demand) -> int:
        good = self._where(entry, demand.variable, demand.good)
        if good == EMPTY and self._lenient:
            values = demand.good if demand.of_resource else (ANYTHING,)
            good = self._sets.union(*(self._sets.assign(entry, demand.variable, v) for v in values))
        return good

    def _tested(self, node: NodeSpec, port: str, settings: ConditionSettings, entry: int) -> tuple[int, int]:
        """Split by whether a comparison of a key may hold, and whether it may fail."""
        demand, key = self._ask(node, port, entry), node.reads[port].key
        if demand is None:
            return entry, entry
        yes, no = verdicts(self.variables, demand, settings)
        variable = self.variables.keys[key]
        held, failed = self._where(entry, variable, yes), self._where(entry, variable, no)
        if held == EMPTY and self._lenient and settings.is_set is None:
            held = self._sets.assign(entry, variable, ANYTHING)
        return held, failed

    # -- leaves ------------------------------------------------------------------------------------------------------

    def _nobody_knows(self, entry: int) -> After:
        lost = self._sets.assign(entry, self.variables.lost, 1)
        return After(lost, lost, lost)

    def _of_faulty_loop(self, node: NodeSpec, entry: int) -> After:
        """How often, over what, until when: nobody knows, so that of what it holds nothing is claimed either."""
        lost = self._nobody_knows(entry)
        self._child(node, lost.success)
        return lost

    def _of_condition(self, node: NodeSpec, entry: int) -> After:
        if "port" not in node.reads or not isinstance(node.settings, ConditionSettings):
            return self._nobody_knows(entry)
        return After(*self._tested(node, "port", node.settings, entry))

    def _of_skill(self, node: NodeSpec, entry: int) -> After:
        skill, sets = node.skill_type, self._sets
        if skill is None:
            return self._nobody_knows(entry)
        for demand in self.demands[id(node)]:
            self._ask(node, demand.port, entry)
        for demand in self.demands[id(node)]:
            entry = self._meeting(entry, demand)
        success = failure = running = entry
        for port, wire in node.writes.items():
            variable = self.variables.keys[wire.key]
            good, bad, part = (self.variables.value(wire.key, written_kind(node, port, how)) for how in HOW)
            success = sets.assign(success, variable, good)
            running = sets.allow(running, variable, (part,))
            if getattr(getattr(skill, port, None), "always", False):
                failure = sets.assign(failure, variable, bad)
            else:
                failure = sets.allow(failure, variable, (bad,))
        for resource, variable in self.variables.resources.items():
            leaves = skill.POSTCONDITIONS.get(resource)
            after = skill.FAILURE_STATES.get(resource, frozenset({UNCHANGED, leaves or UNCHANGED}))
            states = [self.variables.state(resource, s) for s in after - {UNCHANGED}]
            if UNCHANGED in after:
                failure = sets.allow(failure, variable, states)
            else:
                failure = sets.union(*(sets.assign(failure, variable, s) for s in states))
            if leaves is not None:
                value = self.variables.state(resource, leaves)
                success = sets.assign(success, variable, value)
                states.append(value)
            running = sets.allow(running, variable, states)
        return After(success, failure, running)

    # -- composites --------------------------------------------------------------------------------------------------

    def _of_sequence(self, node: NodeSpec, entry: int) -> After:
        failure = running = EMPTY
        for child in node.children:
            after = self.run(child, entry)
            entry = after.success
            failure = self._sets.union(failure, after.failure)
            running = self._sets.union(running, after.running)
        return After(entry, failure, running)

    def _of_selector(self, node: NodeSpec, entry: int) -> After:
        success = running = EMPTY
        for child in node.children:
            after = self.run(child, entry)
            entry = after.failure
            success = self._sets.union(success, after.success)
            running = self._sets.union(running, after.running)
        return After(success, entry, running)

    def _of_parallel(self, node: NodeSpec, entry: int) -> After:
        """Each child is entered as if its siblings had done any part of what they do, and ends as if they had."""
        sets, children = self._sets, node.children
        effects = [self._effects(c) for c in children]
        afters: list[After] = []
        for i, child in enumerate(children):
            theirs = [e for j, e in enumerate(effects) if j != i]
            after = self.run(child, self._stirred(entry, theirs))
            afters.append(After(*(self._stirred(s, theirs) for s in (after.success, after.failure, after.running))))
        anyhow = [sets.union(a.success, a.failure, a.running) for a in afters]
        one = isinstance(node.settings, ParallelSettings) and node.settings.policy == "one"
        unfailed = [sets.union(a.success, a.running) if one else a.success for a in afters]

        def met(chosen: int, others: list[int], i: int) -> int:
            for j, other in enumerate(others):
                chosen = chosen if j == i else sets.meet(chosen, other)
            return chosen

        success = sets.union(*(met(a.success, unfailed, i) for i, a in enumerate(afters)))
        failure = sets.union(*(met(a.failure, anyhow, i) for i, a in enumerate(afters)))
        going = [sets.union(a.success, a.running) for a in afters]
        running = sets.union(*(met(a.running, going, i) for i, a in enumerate(afters)))
        return After(success, failure, running)

    def _effects(self, node: NodeSpec) -> dict[int, set[int]]:
        """Variables that a subtree may change, and to what."""
        effects: dict[int, set[int]] = {}
        variables = self.variables
        for below in node.walk():
            for port, wire in below.writes.items():
                values = effects.setdefault(variables.keys[wire.key], set())
                if below.skill_type is not None:
                    values.update(variables.value(wire.key, k) for k in written_kinds(below, port))
                else:
                    values.update(variables.written(wire.key))
                source = below.reads.get(port)
                if below.kind == "for_each" and source is not None:
                    effects.setdefault(variables.keys[source.key], set()).add(UNSET)
            if below.skill_type is not None:
                skill = below.skill_type
                for resource in {*skill.POSTCONDITIONS, *skill.FAILURE_STATES}:
                    after = {*skill.FAILURE_STATES.get(resource, ()), skill.POSTCONDITIONS.get(resource, UNCHANGED)}
                    values = effects.setdefault(variables.resources[resource], set())
                    values.update(variables.state(resource, s) for s in after - {UNCHANGED})
        return effects

    def _stirred(self, entry: int, effects: Iterable[dict[int, set[int]]]) -> int:
        for effect in effects:
            for variable, values in effect.items():
                entry = self._sets.allow(entry, variable, values)
        return entry

    # -- decorators --------------------------------------------------------------------------------------------------

    def _of_subtree(self, node: NodeSpec, entry: int) -> After:
        return self._child(node, entry)

    def _child(self, node: NodeSpec, entry: int) -> After:
        return self.run(node.children[0], entry) if node.children else self._nobody_knows(entry)

    def _of_invert(self, node: NodeSpec, entry: int) -> After:
        after = self._child(node, entry)
        return After(after.failure, after.success, after.running)

    def _of_succeed(self, node: NodeSpec, entry: int) -> After:
        after = self._child(node, entry)
        return After(self._sets.union(after.success, after.failure), EMPTY, after.running)

    def _of_fail(self, node: NodeSpec, entry: int) -> After:
        after = self._child(node, entry)
        return After(EMPTY, self._sets.union(after.success, after.failure), after.running)

    def _of_timeout(self, node: NodeSpec, entry: int) -> After:
        after = self._child(node, entry)
        return After(after.success, self._sets.union(after.failure, after.running), after.running)

    def _of_retry(self, node: NodeSpec, entry: int) -> After:
        attempts = node.settings.attempts if isinstance(node.settings, RetrySettings) else 1
        passes, last = self._passes(entry, attempts, lambda e: self._child(node, e), lambda a: a.failure)
        between = [a.failure for a in passes[: attempts - 1]]
        return After(
            self._sets.union(*(a.success for a in passes)),
            last.failure,
            self._sets.union(*between, *(a.running for a in passes)),
        )

    def _of_repeat(self, node: NodeSpec, entry: int) -> After:
        settings = node.settings if isinstance(node.settings, RepeatSettings) else RepeatSettings(times=1)
        if settings.until is None or "until" not in node.reads:
            times = settings.times or 1
            passes, last = self._passes(entry, times, lambda e: self._child(node, e), lambda a: a.success)
            between = [a.success for a in passes[: times - 1]]
            return After(
                last.success,
                self._sets.union(*(a.failure for a in passes)),
                self._sets.union(*between, *(a.running for a in passes)),
            )
        until = until_condition(settings)
        held = failed = EMPTY

        def once(e: int) -> After:
            """One pass: success if the condition does not hold after it, so that another is made."""
            nonlocal held, failed
            after = self._child(node, e)
            yes, no = self._tested(node, "until", until, after.success) if after.success != EMPTY else (EMPTY, EMPTY)
            held, failed = self._sets.union(held, yes), self._sets.union(failed, after.failure)
            return After(no, after.failure, after.running)

        passes, last = self._passes(entry, settings.limit, once, lambda a: a.success)
        between = [a.success for a in passes[: settings.limit - 1]]
        return After(
            held,
            self._sets.union(failed, last.success),
            self._sets.union(*between, *(a.running for a in passes)),
        )

    def _passes(
        self, entry: int, limit: int, once: Callable[[int], After], again: Callable[[After], int]
    ) -> tuple[list[After], After]:
        """Each pass that differs from those before, and the pass number `limit` (empty if it is never made)."""
        passes: list[After] = []
        first: dict[int, int] = {}
        while entry != EMPTY and len(passes) < limit:
            if entry in first:
                start = first[entry]
                return passes, passes[start + (limit - 1 - start) % (len(passes) - start)]
            first[entry] = len(passes)
            passes.append(once(entry))
            entry = again(passes[-1])
        return passes, passes[-1] if len(passes) == limit else After()

    def _of_for_each(self, node: NodeSpec, entry: int) -> After:
        settings, variables, sets = node.settings, self.variables, self._sets
        if not isinstance(settings, ForEachSettings) or "items" not in node.reads or "item" not in node.writes:
            return self._child(node, entry)
        items = node.reads["items"].key
        demand = self._ask(node, "items", entry)
        assert demand is not None
        given = self._where(entry, variables.keys[items], demand.good - {UNSET})
        if self._has_unknown:  # what nobody knows may have written items of any kind
            lost = sets.assign(sets.where(given, variables.lost, (1,)), variables.keys[items], ANYTHING)
            given = sets.union(sets.where(given, variables.lost, (0,)), lost)
        if given == EMPTY and self._lenient:
            given = sets.assign(entry, variables.keys[items], ANYTHING)
        unset = self._where(entry, variables.keys[items], (UNSET,))
        pairs = {p: (node.reads[p].key, w.key) for p, w in node.writes.items() if p in node.reads}
        # Which items there are is known when it begins: what is gathered may go to their own key.
        begun = {
            k: self._cleared(sets.where(given, variables.keys[items], (k,)), pairs) for k in variables.written(items)
        }
        start = sets.union(*begun.values())
        go_on = settings.on_failure == "continue"
        none, some, running, failure = start, EMPTY, EMPTY, EMPTY
        seen: set[tuple[int, int]] = set()
        ends_none = ends_some = EMPTY
        kinds = [variables.kind(items, k) for k, s in begun.items() if s != EMPTY]
        while (none, some) not in seen:  # any number of items
            seen.add((none, some))
            after_none, after_some = (self._item(node, s, kinds, pairs) for s in (none, some))
            succeeded = sets.union(after_none.success, after_some.success)
            running = sets.union(running, after_none.running, after_some.running)
            if go_on:
                ends_none, ends_some = after_none.failure, sets.union(succeeded, after_some.failure)
            else:
                failure = sets.union(failure, after_none.failure, after_some.failure)
                ends_none, ends_some = EMPTY, succeeded
            running = sets.union(running, ends_none, ends_some)
            failure = sets.union(failure, ends_none)
            none, some = sets.union(none, ends_none), sets.union(some, ends_some)
        return After(sets.union(start, some), sets.union(failure, self._cleared(unset, pairs)), running)

    def _cleared(self, entry: int, pairs: dict[str, tuple[str, str]]) -> int:
        """With an empty tuple in each key that is gathered."""
        for source, target in pairs.values():
            kind = gathered_kind(dict.fromkeys(self._kinds_of(source)))
            entry = self._sets.assign(entry, self.variables.keys[target], self.variables.value(target, kind))
        return entry

    def _kinds_of(self, key: str) -> list[Kind]:
        return [self.variables.kind(key, v) for v in self.variables.written(key) if v != ANYTHING]

    def _item(self, node: NodeSpec, entry: int, kinds: list[Kind], pairs: dict[str, tuple[str, str]]) -> After:
        """One item."""
        if entry == EMPTY:
            return After()
        sets, variables = self._sets, self.variables
        for source, _ in pairs.values():
            entry = sets.assign(entry, variables.keys[source], UNSET)
        item = node.writes["item"].key
        values = {variables.value(item, item_kind(k)) for k in kinds}
        after = self._child(node, sets.union(*(sets.assign(entry, variables.keys[item], v) for v in values)))
        whole, part = after.success, EMPTY
        for port, (source, _) in pairs.items():
            self._ask(node, port, after.success)
            part = sets.union(part, self._where(whole, variables.keys[source], (UNSET,)))
            whole = self._where(whole, variables.keys[source], variables.written(source))
        for source, target in pairs.values():
            gathered = [
                sets.assign(
                    sets.where(whole, variables.keys[source], (value,)),
                    variables.keys[target],
                    variables.value(target, gathered_kind({variables.kind(source, value): None})),
                )
                for value in variables.written(source)
            ]
            whole = sets.union(*gathered)
        return After(sets.union(whole, part), after.failure, after.running)


def _is_faulty_loop(node: NodeSpec) -> bool:
    return node.kind in ("repeat", "for_each") and node.settings is None
