"""Which keys are written when a node is reached: a forward data-flow analysis over the tree, before anything moves.

The state at a point maps each key to the writers that may have written it last, and says whether it is written on
EVERY path to that point. Each node turns the state before it into one state after success and one after failure (None:
cannot happen); joins are unions of writers. Loops run to a fixpoint (the lattice is finite). Reads are judged on the
final states: a skill's required input must be written on every path; a condition or a for_each only on some path, for
they can fail.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from glotouch_bt.mission.findings import Findings
from glotouch_bt.mission.nodes import ConditionSettings, ForEachSettings, NodeSpec, ParallelSettings, RepeatSettings
from glotouch_bt.mission.source import Place


@dataclass(frozen=True)
class Writer:
    """Who writes a key, and what.

    Attributes:
        node: Node name.
        place: Where it stands.
        data_type: Type of the value; `object` when not known.
        element: Type of a tuple's items; `object` when not known.
    """

    node: str
    place: Place
    data_type: type = object
    element: type = object


@dataclass(frozen=True)
class Known:
    """What is known of one key: written on every path, and by whom it may have been."""

    always: bool
    writers: frozenset[Writer]


State = Mapping[str, Known]
After = tuple["State | None", "State | None"]


def join(*states: State | None) -> State | None:
    """The state where paths meet; a path that cannot happen does not count."""
    live = [s for s in states if s is not None]
    if not live:
        return None
    nothing = Known(False, frozenset())
    keys = dict.fromkeys(k for s in live for k in s)
    return {
        k: Known(
            all(s.get(k, nothing).always for s in live), frozenset().union(*(s.get(k, nothing).writers for s in live))
        )
        for k in keys
    }


def write(state: State, writes: Iterable[tuple[str, Writer]], *, always: bool) -> State:
    """The state after some writes that surely (`always`) or perhaps happen."""
    after = dict(state)
    for key, writer in writes:
        if always:
            after[key] = Known(True, frozenset({writer}))
        else:
            old = after.get(key, Known(False, frozenset()))
            after[key] = replace(old, writers=old.writers | {writer})
    return after


def check_flow(root: NodeSpec, findings: Findings) -> None:
    """Report every read of an unwritten key, every type mismatch and every child that can never be reached."""
    _Flow(root, findings).run(root, {}, report=True)


def _fields(kind: type) -> list[str]:
    """What values of a type can be asked for: their public attributes."""
    declared = [f.name for f in dataclasses.fields(kind)] if dataclasses.is_dataclass(kind) else []
    return [*declared, *(n for n in dir(kind) if not n.startswith("_") and n not in declared)]


class _Flow:
    def __init__(self, root: NodeSpec, findings: Findings) -> None:
        self._findings = findings
        self._written_by: dict[str, list[NodeSpec]] = {}
        for node in root.walk():
            for wire in node.writes.values():
                self._written_by.setdefault(wire.key, []).append(node)

    def run(self, node: NodeSpec, state: State, report: bool) -> After:
        """States after success and after failure of a node entered in `state`."""
        method = getattr(self, f"_{node.kind}", None)
        return method(node, state, report) if method else (state, state)

    # composites

    def _sequence(self, node: NodeSpec, state: State, report: bool) -> After:
        now: State | None = state
        failed: list[State | None] = []
        for i, child in enumerate(node.children):
            if now is None:
                self._unreachable(child, node.children[i - 1], "fails", report)
                break
            now, failure = self.run(child, now, report)
            failed.append(failure)
        return now, join(*failed)

    def _selector(self, node: NodeSpec, state: State, report: bool) -> After:
        now: State | None = state
        done: list[State | None] = []
        for i, child in enumerate(node.children):
            if now is None:
                self._unreachable(child, node.children[i - 1], "succeeds", report)
                break
            success, now = self.run(child, now, report)
            done.append(success)
        return join(*done), now

    def _parallel(self, node: NodeSpec, state: State, report: bool) -> After:
        # Siblings may write at any time: each child sees their writes as possible.
        shared = state
        for child in node.children:
            shared = write(shared, self._all_writes(child), always=False)
        after = [self.run(child, shared, report) for child in node.children]
        wins = [s for s, _ in after]
        fails = join(*(f for _, f in after))
        if isinstance(node.settings, ParallelSettings) and node.settings.policy == "one":
            return join(*wins), None if fails is None else shared
        if any(w is None for w in wins):
            return None, None if fails is None else shared
        merged = dict(shared)
        for win in wins:
            for key, known in (win or {}).items():
                old = merged.get(key, known)
                merged[key] = Known(old.always or known.always, old.writers | known.writers)
        return merged, None if fails is None else shared

    # decorators

    def _only(self, node: NodeSpec, state: State, report: bool) -> After:
        return self.run(node.children[0], state, report) if node.children else (state, state)

    def _subtree(self, node: NodeSpec, state: State, report: bool) -> After:
        return self._only(node, state, report)

    def _invert(self, node: NodeSpec, state: State, report: bool) -> After:
        success, failure = self._only(node, state, report)
        return failure, success

    def _succeed(self, node: NodeSpec, state: State, report: bool) -> After:
        return join(*self._only(node, state, report)), None

    def _fail(self, node: NodeSpec, state: State, report: bool) -> After:
        return None, join(*self._only(node, state, report))

    def _timeout(self, node: NodeSpec, state: State, report: bool) -> After:
        success, failure = self._only(node, state, report)
        return success, join(failure, write(state, self._all_writes(node), always=False))

    def _retry(self, node: NodeSpec, state: State, report: bool) -> After:
        entry = self._fixpoint(node, state, lambda success, failure: failure)
        return self._only(node, entry, report)

    def _repeat(self, node: NodeSpec, state: State, report: bool) -> After:
        entry = self._fixpoint(node, state, lambda success, failure: success)
        success, failure = self._only(node, entry, report)
        if not isinstance(node.settings, RepeatSettings) or node.settings.until is None:
            return success, failure
        if success is None:
            return None, failure
        wire = node.reads.get("until")
        if wire and report:
            compare = node.settings.until if isinstance(node.settings.until, ConditionSettings) else None
            self._compare(node, wire.key, wire.place, success, compare)
        return _sure(success, wire.key) if wire else success, join(failure, success)

    def _for_each(self, node: NodeSpec, state: State, report: bool) -> After:
        settings = node.settings
        if not isinstance(settings, ForEachSettings) or "items" not in node.reads or "item" not in node.writes:
            return self._only(node, state, report)
        items, item = node.reads["items"], node.writes["item"]
        known = state.get(items.key)
        if report:
            self._read(node, items.key, items.place, tuple, state, "items", must=False)
        elements = {w.element for w in known.writers} if known else {object}
        element = elements.pop() if len(elements) == 1 else object
        if report and settings.least_first is not None and element is not object:
            fields = _fields(element)
            if settings.least_first not in fields:
                what = f"field of {element.__name__}:"
                self._findings.unknown(node.place, "unknown_field", what, settings.least_first, fields)
        given = [(item.key, Writer(node.name, item.place, element))]

        def again(success: State | None, failure: State | None) -> State | None:
            return join(success, failure if settings.on_failure == "continue" else None)

        entry = write(self._fixpoint(node, write(state, given, always=True), again), given, always=True)
        success, failure = self._only(node, entry, report)
        gathered: list[tuple[str, Writer]] = []
        for port, target in node.writes.items():
            source = node.reads.get(port)
            if source is None:
                continue
            made = (success or {}).get(source.key)
            if report and success is not None and (made is None or not made.writers):
                self._unwritten(node, source.key, source.place, port, entry)
            types = {w.data_type for w in made.writers} if made else {object}
            gathered.append(
                (target.key, Writer(node.name, target.place, tuple, types.pop() if len(types) == 1 else object))
            )
        # No item at all: the child never ran.
        left = join(state, success, failure) or state
        return write(left, gathered, always=True), write(left, gathered, always=True)

    def _fixpoint(self, node: NodeSpec, state: State, again: Any) -> State:
        """The state at the child's entry, over any number of passes."""
        entry = state
        while True:
            grown = join(entry, again(*self._only(node, entry, False))) or entry
            if grown == entry:
                return entry
            entry = grown

    # leaves

    def _condition(self, node: NodeSpec, state: State, report: bool) -> After:
        wire, settings = node.reads.get("port"), node.settings
        if wire is None or not isinstance(settings, ConditionSettings):
            return state, state
        if report:
            self._compare(node, wire.key, wire.place, state, settings)
        return state if settings.is_set is False else _sure(state, wire.key), state

    def _skill(self, node: NodeSpec, state: State, report: bool) -> After:
        skill = node.skill_type
        if skill is None:
            return state, state
        if report:
            for port, wire in node.reads.items():
                if port in node.constants:
                    continue
                info = skill.INPUT_PORTS[port]
                self._read(
                    node, wire.key, wire.place, info.data_type, state, port, must=info.required, soft=not info.required
                )
        writes = {p: (w.key, self._writer(node, p)) for p, w in node.writes.items()}
        certain = [writes[p] for p in writes if getattr(getattr(skill, p, None), "always", False)]
        failed = write(write(state, writes.values(), always=False), certain, always=True)
        return write(state, writes.values(), always=True), failed

    # reads

    def _writer(self, node: NodeSpec, port: str) -> Writer:
        assert node.skill_type is not None
        element = getattr(getattr(node.skill_type, port, None), "element", None) or object
        return Writer(node.name, node.writes[port].place, node.skill_type.OUTPUT_PORTS[port].data_type, element)

    def _all_writes(self, node: NodeSpec) -> list[tuple[str, Writer]]:
        return [
            (w.key, self._writer(n, p) if n.kind == "skill" else Writer(n.name, w.place))
            for n in node.walk()
            for p, w in n.writes.items()
        ]

    def _read(
        self,
        node: NodeSpec,
        key: str,
        place: Place,
        wanted: Any,
        state: State,
        port: str,
        *,
        must: bool,
        soft: bool = False,
    ) -> None:
        known = state.get(key)
        if known is None or not known.writers:
            # An optional input may stay unwritten, unless the mission wired it on purpose.
            if not soft or place != node.place:
                self._unwritten(node, key, place, port, state)
            return
        if must and not known.always:
            by = ", ".join(sorted(f"{w.node!r} (line {w.place.line})" for w in known.writers))
            what = f"{node.name!r} reads {_shown(port, key)}, which is written only on some paths to it, by {by}"
            self._findings.add(place, "port_maybe_unset", what)
        for writer in sorted(known.writers, key=lambda w: w.place):
            if not _fits(writer.data_type, wanted):
                what = f"{node.name!r} reads {_shown(port, key)} as {_type_name(wanted)}, but {writer.node!r}"
                what += f" (line {writer.place.line}) writes {_type_name(writer.data_type)}"
                self._findings.add(place, "port_type", what)

    def _unwritten(self, node: NodeSpec, key: str, place: Place, port: str, state: State) -> None:
        later = [n for n in self._written_by.get(key, []) if n is not node]
        what = f"{node.name!r} reads {_shown(port, key)}, which no node writes before it"
        if later:
            what += f"; {later[0].name!r} at line {later[0].place.line} writes it, but later or elsewhere"
        self._findings.add(
            place, "port_unset", what, valid=", ".join(sorted(k for k in state)) or "no key is written yet"
        )

    def _compare(
        self, node: NodeSpec, key: str, place: Place, state: State, settings: ConditionSettings | None
    ) -> None:
        if settings is not None and settings.is_set is not None:
            if not self._written_by.get(key):
                self._unwritten(node, key, place, "port", state)
            return
        wanted: Any = bool if settings is None else object
        if settings is not None and (settings.at_least is not None or settings.at_most is not None):
            wanted = int | float
        elif settings is not None and settings.equals is not None:
            number = isinstance(settings.equals, (int, float)) and not isinstance(settings.equals, bool)
            wanted = int | float if number else type(settings.equals)
        self._read(node, key, place, wanted, state, "until" if node.kind == "repeat" else "port", must=False)

    def _unreachable(self, child: NodeSpec, before: NodeSpec, word: str, report: bool) -> None:
        if report:
            what = f"{child.name!r} can never be reached: {before.name!r} (line {before.place.line}) always {word}"
            self._findings.add(child.place, "unreachable", what)


def _sure(state: State, key: str) -> State:
    return {**state, key: replace(state[key], always=True)} if key in state else state


def _shown(port: str, key: str) -> str:
    name = key.rsplit("/", 1)[-1]
    return f"port {port!r}" if port == name else f"port {port!r} (key {name!r})"


def _type_name(wanted: Any) -> str:
    return getattr(wanted, "__name__", str(wanted))


def _fits(given: type, wanted: Any) -> bool:
    """A value of type `given` passes py_trees' run-time check of `wanted`; unknown types pass."""
    if given is object or wanted is object:
        return True
    options = getattr(wanted, "__args__", None) if not isinstance(wanted, type) else (wanted,)
    plain = [o for o in options or () if isinstance(o, type)]
    if not plain:
        return True
    if given is bool and bool not in plain:
        return False
    return any(issubclass(given, o) for o in plain)
