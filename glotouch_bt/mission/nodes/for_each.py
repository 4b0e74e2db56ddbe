"""`for_each`: the child once for every item of a tuple."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Literal

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from pydantic import Field

from glotouch_bt.mission.nodes.base import (
    ANYTHING,
    EMPTY,
    UNSET,
    BtcppForm,
    BuildContext,
    DataFlowAnalysis,
    ExitStates,
    Keys,
    MissionDecorator,
    NodeKind,
    NodeReader,
    PathSearch,
    Position,
    Requirement,
    RunCount,
    Stack,
    StateVariables,
    ValueKind,
    Values,
    btcpp_key,
    btcpp_name,
    port_requirement,
    wire_setting,
)
from glotouch_bt.mission.spec import Map, NodeSpec, Scalar, Settings
from glotouch_bt.skill import param

Pairs = Mapping[str, tuple[str, str]]  # (source key, target key) of each port that gathers


class ForEachSettings(Settings):
    """Do the child for each item of a tuple."""

    items: str = Field(description="key holding the tuple")
    item: str = Field(description="key each item is written to")
    collect: dict[str, str] = Field(default_factory=dict, description="child's key: key of the tuple it is gathered in")
    on_failure: Literal["continue", "stop"] = Field(default="stop", description="what a failing item does")
    order_by: str | None = param("field by which items are sorted, ascending", default=None)


class ForEach(MissionDecorator):
    """Run the child for every item of a tuple, one pass a tick at most, and gather what it writes.

    SUCCESS: every item succeeded (`on_failure: stop`), or at least one did (`continue`), or there is no item.
    FAILURE: the items are not written; an item failed (`stop`); no item succeeded (`continue`).
    The gathered tuples hold one value per item that succeeded, in the items' order, and are written in each case. With
    `order_by` the items are taken in rising order of that field. `collect` maps a key that the child writes to the
    key of its tuple.
    """

    kept = ("_items", "_order", "_next", "_succeeded", "_gathered")

    def __init__(
        self,
        name: str,
        child: Behaviour,
        keys: Keys,
        items: str,
        item: str,
        collect: Mapping[str, str],
        settings: ForEachSettings,
    ) -> None:
        super().__init__(name, child)
        self._keys, self._items_key, self._item_key = keys, items, item
        self._collect, self._settings = dict(collect), settings
        self._items: tuple[Any, ...] = ()
        self._order: list[int] = []
        self._next = 0
        self._succeeded = 0
        self._gathered: dict[str, dict[int, Any]] = {}

    def enter(self) -> None:
        """Begin, or go on with the present item: write it."""
        super().enter()
        if self._next < len(self._items):
            self._keys.set(self._item_key, self._items[self._order[self._next]])

    def initialise(self) -> None:
        """Take the items as they are now."""
        super().initialise()
        self._next = self._succeeded = 0
        self._gathered = {source: {} for source in self._collect}
        items = self._keys.get(self._items_key)
        self._items = tuple(items) if items is not None else ()
        self._order = list(range(len(self._items)))
        if (field := self._settings.order_by) is not None:
            self._order.sort(key=lambda i: getattr(self._items[i], field))
        if items is None:
            self.fail("no_items", f"{self._items_key!r} has not been written")
        for target in self._collect.values():
            self._keys.set(target, ())

    def tick(self) -> Iterator[Behaviour]:
        """Tick the child with its item written; without items the child is not ticked."""
        if self.status is not Status.RUNNING:
            self.initialise()
        if self._next < len(self._items):
            if self.decorated.status is not Status.RUNNING:
                for source in self._collect:
                    self._keys.unset(source)
                self._keys.set(self._item_key, self._items[self._order[self._next]])
            yield from self.decorated.tick()
        new_status = self.update()
        if new_status is not Status.RUNNING:
            self.stop(new_status)
        self.status: Status = new_status
        yield self

    def update(self) -> Status:
        """Return the result of a finished item."""
        if not self._items:
            return Status.FAILURE if self.feedback_message else Status.SUCCESS
        status, number = self.decorated.status, len(self._items)
        if status is Status.RUNNING:
            return Status.RUNNING
        if status is Status.SUCCESS:
            self._succeeded += 1
            self._gather()
        elif self._settings.on_failure == "stop":
            return self.fail("item_failed", f"item {self._next + 1} of {number} failed", item=self._next + 1)
        self._next += 1
        if self._next < number:
            return Status.RUNNING
        if self._succeeded == 0:
            of = "the only item failed" if number == 1 else f"none of {number} items succeeded"
            return self.fail("all_items_failed", of, items=number)
        return Status.SUCCESS

    def _gather(self) -> None:
        """Gather only whole rows: an item whose child left a key unwritten is not gathered at all."""
        row = {source: self._keys.get(source) for source in self._collect}
        if any(v is None for v in row.values()):
            return
        for source, value in row.items():
            gathered = self._gathered[source]
            gathered[self._order[self._next]] = value
            self._keys.set(self._collect[source], tuple(gathered[i] for i in sorted(gathered)))


class ForEachKind(NodeKind):
    """Run the child once for every item."""

    name = "for_each"
    description = "do the child for every item of a tuple"
    Settings = ForEachSettings
    btcpp, sign = "ForEach", "∀"
    revisits = branches_on_unset = needs_settings = True

    def wire(self, node: NodeSpec, given: Map, unit: str, reader: NodeReader) -> None:
        """Wire the items, the item, and for each gathered key the port `collect.KEY`: its source and its target."""
        items, item = wire_setting("items", given, reader), wire_setting("item", given, reader)
        reads = {"items": items} if items else {}
        writes = {"item": item} if item else {}
        collect = given.get("collect")
        for key, value in collect.entries if isinstance(collect, Map) else ():
            port = f"collect.{key.value}"
            source = reader.wire(port, str(key.value), key.place)
            if source and isinstance(value, Scalar) and isinstance(value.value, str) and not value.poisoned:
                target = reader.wire(port, value.value, value.place)
                if target:
                    if target.key in {w.key for w in writes.values()}:
                        what = f"two things are written to {value.value!r}"
                        reader.findings.add(target.place, "written_twice", what)
                    reads[port], writes[port] = source, target
        node.reads, node.writes = reads, writes

    @staticmethod
    def _is_wired(node: NodeSpec) -> bool:
        return "items" in node.reads and "item" in node.writes

    def gathers(self, node: NodeSpec) -> Pairs:
        """Return those of `collect`."""
        return {p: (node.reads[p].key, w.key) for p, w in node.writes.items() if p in node.reads}

    def requirements(self, node: NodeSpec, variables: StateVariables) -> Iterator[Requirement]:
        """Yield those of the items and of every gathered key."""
        for port in node.reads:
            yield port_requirement(node, port, variables, "not always", tuple if port == "items" else object)

    def written_kinds(self, node: NodeSpec, port: str, held: Callable[[str], list[ValueKind]]) -> list[ValueKind]:
        """Return the kinds of the item, or of a tuple of what is gathered."""
        if port == "item" and "items" in node.reads:
            return [k.item for k in held(node.reads["items"].key)]
        if port in node.reads:
            return [ValueKind.tuple_of([k]) for k in held(node.reads[port].key)]
        return super().written_kinds(node, port, held)

    def derived_kinds(self, node: NodeSpec, held: Callable[[str], list[ValueKind]]) -> list[tuple[str, ValueKind]]:
        """Return those of the item and of the tuples it gathers."""
        if not self._is_wired(node):
            return []
        found = [(node.writes["item"].key, k.item) for k in held(node.reads["items"].key)]
        for source, target in self.gathers(node).values():
            found.append((target, ValueKind.tuple_of(held(source))))
            found += [(target, ValueKind.tuple_of([k])) for k in held(source)]
        return found

    def effects(self, node: NodeSpec, variables: StateVariables) -> Iterator[tuple[int, set[int]]]:
        """Yield what it writes, and that it unsets what it gathers before every item."""
        yield from super().effects(node, variables)
        for source, _ in self.gathers(node).values():
            yield variables.keys[source], {UNSET}

    def required_keys(self, node: NodeSpec) -> list[str]:
        """Return the key of the items."""
        return [node.reads["items"].key]

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Follow any number of items, until nothing new is found."""
        if not self._is_wired(node):
            return flow.child(node, entry)
        variables, sets = flow.variables, flow.sets
        items = node.reads["items"].key
        variable = variables.keys[items]
        requirement = flow.look(node, "items", entry)
        assert requirement is not None
        given = flow.where(entry, variable, requirement.good - {UNSET})
        if flow.has_unknown:  # an unknown node may have written items of any kind
            lost_items = sets.assign(sets.where(given, variables.lost, (1,)), variable, ANYTHING)
            given = sets.union(sets.where(given, variables.lost, (0,)), lost_items)
        if given == EMPTY and flow.lenient:
            given = sets.assign(entry, variable, ANYTHING)
        unset = flow.where(entry, variable, (UNSET,))
        pairs = self.gathers(node)
        # The items are read when it begins: what is gathered may go to their own key.
        begun = {k: _cleared(flow, sets.where(given, variable, (k,)), pairs) for k in variables.written(items)}
        start = sets.union(*begun.values())
        kinds = [variables.kind(items, k) for k, s in begun.items() if s != EMPTY]
        none, some, running, failure = start, EMPTY, EMPTY, EMPTY  # none, some: whether an item has succeeded
        seen: set[tuple[int, int]] = set()
        while (none, some) not in seen:
            seen.add((none, some))
            after_none, after_some = (_one_item(flow, node, s, kinds, pairs) for s in (none, some))
            succeeded = sets.union(after_none.success, after_some.success)
            running = sets.union(running, after_none.running, after_some.running)
            if self.catches_failure(node):
                ends_none, ends_some = after_none.failure, sets.union(succeeded, after_some.failure)
            else:
                failure = sets.union(failure, after_none.failure, after_some.failure)
                ends_none, ends_some = EMPTY, succeeded
            running = sets.union(running, ends_none, ends_some)
            failure = sets.union(failure, ends_none)
            none, some = sets.union(none, ends_none), sets.union(some, ends_some)
        return ExitStates(sets.union(start, some), sets.union(failure, _cleared(flow, unset, pairs)), running)

    def enter(self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values) -> Iterator[Position]:
        """Begin with no items, or with the first one."""
        if not self._is_wired(node):
            yield from super().enter(search, node, stack, values)
            return
        if search.reached(node, "items", values):
            yield Position((), values, "goal")
            return
        variables, found = search.variables, search.may_hold(node, "items", values)
        for variable, value in _empty_tuples(variables, self.gathers(node)):
            values = search.assign(values, variable, value)
        # A loop without items waits for a step like a leaf: otherwise a loop around it would never come to one.
        if UNSET in found:
            yield Position(search.push(stack, node, False), values)
        kinds = sorted(found - {UNSET})
        if kinds:
            yield Position(search.push(stack, node, True), values)
        for items_kind in kinds:
            yield from self._next_item(search, node, stack, values, items_kind, False)

    def _next_item(
        self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values, items_kind: int, won: bool
    ) -> Iterator[Position]:
        variables = search.variables
        for source, _ in self.gathers(node).values():
            values = search.assign(values, variables.keys[source], UNSET)
        item = node.writes["item"].key
        kind = variables.kind(node.reads["items"].key, items_kind).item
        values = search.assign(values, variables.keys[item], variables.value(item, kind))
        yield from search.enter(node.children[0], search.push(stack, node, (items_kind, won)), values)

    def leave(
        self, search: PathSearch, node: NodeSpec, stack: Stack, succeeded: bool, values: Values, memory: Any
    ) -> Iterator[Position]:
        """Gather; then end, or enter the child with the next item."""
        if memory is None or (not succeeded and not self.catches_failure(node)):
            yield from search.leave(stack, succeeded, values)
            return
        items_kind, won = memory
        if succeeded:
            if any(search.reached(node, p, values) for p in node.reads if p != "items"):
                yield Position((), values, "goal")
                return
            values = self._gathered(search, node, values)
        yield from search.leave(stack, succeeded or won, values)
        yield from self._next_item(search, node, stack, values, items_kind, succeeded or won)

    def _gathered(self, search: PathSearch, node: NodeSpec, values: Values) -> Values:
        variables, pairs = search.variables, self.gathers(node).values()
        found = {s: search.followed(values, variables.keys[s]) for s, _ in pairs}
        if UNSET in found.values():
            return values
        for source, target in pairs:
            value = found[source]
            if value is not None:
                kind = ValueKind.tuple_of([variables.kind(source, value)])
                values = search.assign(values, variables.keys[target], variables.value(target, kind))
        return values

    def step(
        self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values, memory: Any
    ) -> Iterator[tuple[str, Position]]:
        """End without an item: in success if there is none, in failure if the items are not written."""
        for there in search.leave(stack, bool(memory), values):
            yield f"{node.name} has {'no item' if memory else 'nothing to go through'}", there

    def max_runs(self, node: NodeSpec) -> RunCount:
        """Return the child's number, times n."""
        below = super().max_runs(node)
        return below if node.settings is None else RunCount((0, *below.terms))

    def ordered_by(self, node: NodeSpec) -> tuple[str, str] | None:
        """Return the items' key and `order_by`."""
        field = node.settings.order_by if isinstance(node.settings, ForEachSettings) else None
        return (node.reads["items"].key, field) if field is not None and "items" in node.reads else None

    def loses_gathered(self, node: NodeSpec) -> bool:
        """Return True if it gathers and `on_failure` is not written."""
        settings = node.settings
        if not isinstance(settings, ForEachSettings):
            return False
        return "on_failure" not in settings.model_fields_set and bool(settings.collect)

    def catches_failure(self, node: NodeSpec) -> bool:
        """True with `on_failure: continue`."""
        return isinstance(node.settings, ForEachSettings) and node.settings.on_failure == "continue"

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return the loop."""
        assert isinstance(node.settings, ForEachSettings)
        items, item = node.reads["items"].key, node.writes["item"].key
        collect = {w.key: node.writes[p].key for p, w in node.reads.items() if p != "items"}
        keys = made.keys(node.name, items, item, *collect, *collect.values())
        return ForEach(node.name, children[0], keys, items, item, collect, node.settings)

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it as this project's decorator."""
        settings = node.settings
        assert isinstance(settings, ForEachSettings)
        keys = {"items": btcpp_key(node.reads["items"].key), "item": btcpp_key(node.writes["item"].key)}
        collect = ";".join(f"{btcpp_name(s)}:{btcpp_name(t)}" for s, t in self.gathers(node).values())
        rest = {"collect": collect, "order_by": settings.order_by or "", "on_failure": settings.on_failure}
        return BtcppForm(self.btcpp, keys | {k: v for k, v in rest.items() if v}, ForEachSettings.model_fields)


def _empty_tuples(variables: StateVariables, pairs: Pairs) -> Iterator[tuple[int, int]]:
    """Yield (variable, value) of each key that gathers, when the loop begins."""
    for source, target in pairs.values():
        kind = ValueKind.tuple_of(variables.written_kinds(source)[1:])
        yield variables.keys[target], variables.value(target, kind)


def _cleared(flow: DataFlowAnalysis, entry: int, pairs: Pairs) -> int:
    """Return the states with an empty tuple in each key that gathers."""
    for variable, value in _empty_tuples(flow.variables, pairs):
        entry = flow.sets.assign(entry, variable, value)
    return entry


def _one_item(flow: DataFlowAnalysis, node: NodeSpec, entry: int, kinds: list[ValueKind], pairs: Pairs) -> ExitStates:
    """Return the states after one item of one of these kinds of items."""
    if entry == EMPTY:
        return ExitStates()
    sets, variables = flow.sets, flow.variables
    keys = variables.keys
    for source, _ in pairs.values():
        entry = sets.assign(entry, keys[source], UNSET)
    item = node.writes["item"].key
    values = {variables.value(item, k.item) for k in kinds}
    after = flow.child(node, sets.union(*(sets.assign(entry, keys[item], v) for v in values)))
    whole, part = after.success, EMPTY
    for port, (source, _) in pairs.items():
        flow.look(node, port, after.success)
        part = sets.union(part, flow.where(whole, keys[source], (UNSET,)))
        whole = flow.where(whole, keys[source], variables.written(source))
    for source, target in pairs.values():
        gathered = EMPTY
        for value in variables.written(source):
            made = variables.value(target, ValueKind.tuple_of([variables.kind(source, value)]))
            having = sets.where(whole, keys[source], (value,))
            gathered = sets.union(gathered, sets.assign(having, keys[target], made))
        whole = gathered
    return ExitStates(sets.union(whole, part), after.failure, after.running)
