"""From the sets of a tree's analysis to findings: what is looked at and not there, never reached, or out of place."""

from __future__ import annotations

import dataclasses
import inspect
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, get_type_hints

from glotouch_bt.mission.check.counterexample import Goal, Patience, shortest_path
from glotouch_bt.mission.check.data_flow import Flow
from glotouch_bt.mission.check.lint import check_habits
from glotouch_bt.mission.check.requirements import Demand, all_demands, same_quantity
from glotouch_bt.mission.check.state_sets import EMPTY
from glotouch_bt.mission.check.state_variables import (
    ANYTHING,
    UNSET,
    Kind,
    Variables,
    gathered_kind,
    item_kind,
    written_kinds,
)
from glotouch_bt.mission.spec import Findings, ForEachSettings, NodeSpec, Place

MAX_PATHS = 40
"""Findings beyond so many are reported without a path."""
DEEPEST_PYTHON = 50_000


def check_flow(
    tree: NodeSpec, findings: Findings, leaves: Mapping[str, tuple[frozenset[str], Place]], timeout_s: float
) -> None:
    """Report what can go wrong on some run of a tree.

    Args:
        tree: Its root, names numbered.
        findings: Where faults go.
        leaves: States in which the mission says it leaves resources after success, and where it says so.
        timeout_s: Longest duration of the mission.
    """
    with _deep_recursion():
        variables = Variables(tree)
        demands = all_demands(tree, variables)
        exact = Flow(tree, variables, demands)
        blocked = any(exact.entered.get(id(n), EMPTY) == EMPTY for n in tree.walk())
        lenient = Flow(tree, variables, demands, lenient=True) if blocked else exact
        _Judge(exact, lenient, findings).all(leaves)
        check_habits(lenient, findings, timeout_s)


@contextmanager
def _deep_recursion() -> Iterator[None]:
    """Diagrams are as deep as there are keys; see `configurations`."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, DEEPEST_PYTHON))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)


class _Judge:
    """Findings about what is entered in a run come from the exact sets, those behind a mistake from the lenient."""

    def __init__(self, exact: Flow, lenient: Flow, findings: Findings) -> None:
        self._exact, self._lenient, self._findings = exact, lenient, findings
        self._variables, self._sets = exact.variables, exact.variables.sets
        self._writers = _writers(exact.tree, exact.variables)
        self._paths, self._patience = 0, Patience()

    def all(self, leaves: Mapping[str, tuple[frozenset[str], Place]]) -> None:
        for node in self._exact.tree.walk():
            for demand in self._exact.demands[id(node)]:
                self._demand(demand)
            if node.kind == "for_each":
                self._least_first(node)
        self._unreachable(self._exact.tree)
        self._end(leaves)

    # -- keys and resources ------------------------------------------------------------------------------------------

    def _demand(self, demand: Demand) -> None:
        flow = self._exact if self._exact.asked.get(demand, EMPTY) != EMPTY else self._lenient
        asked = flow.judged(demand)
        if asked == EMPTY:
            return
        found = self._sets.values(asked, demand.variable)
        if demand.unset == "not always":  # what a mistake before it kept from being written is no mistake here
            found |= self._sets.values(self._lenient.judged(demand), demand.variable) - {ANYTHING}
        wrong = found - demand.good - {UNSET}
        if demand.of_resource:
            if bad := found - demand.good:
                self._wrong_state(flow, demand, bad, always=not found & demand.good)
            return
        if self._never_written(demand, found):
            self._unset(flow, demand, asked)
        elif UNSET in found and UNSET not in demand.good:
            by = ", ".join(f"{n.name!r} (line {p.line})" for n, p in self._places(demand))
            what = f"{_reader(demand)}, which is written only on some paths to it, by {by}"
            path = self._path(flow, demand, {UNSET})
            self._findings.add(demand.place, "port_maybe_unset", what, path=path, node=demand.node.name)
        alike: dict[Kind, set[int]] = {}  # what differs in its value only is one mistake
        for value in sorted(wrong):
            alike.setdefault(dataclasses.replace(self._variables.kind(demand.key, value), value=None), set()).add(value)
        for kind, values in alike.items():
            self._wrong_kind(flow, demand, kind, values)

    def _never_written(self, demand: Demand, found: frozenset[int]) -> bool:
        if demand.unset == "allowed":
            # A test of whether it is set makes sense only if somebody sets it.
            return demand.node.kind == "condition" and not self._writers.get(demand.key)
        return found == {UNSET}

    def _places(self, demand: Demand) -> list[tuple[NodeSpec, Place]]:
        """Who writes a key, each once; the reader itself last."""
        found = {n.name: (n, p) for n, p, _ in self._writers.get(demand.key, [])}
        return sorted(found.values(), key=lambda w: (w[0] is demand.node, w[1]))

    def _unset(self, flow: Flow, demand: Demand, asked: int) -> None:
        what = f"{_reader(demand)}, which no node writes before it"
        name = demand.key.rpartition("/")[2]
        inside = {k.partition("@")[0] for k in self._writers if k != demand.key and k.rpartition("/")[2] == name}
        for subtree in sorted(inside - {name}):
            what += f"; subtree {subtree!r} keeps its own {name!r} to itself, unless it is wired with ports"
        later = [(n, p) for n, p in self._places(demand) if n is not demand.node]
        if later:
            what += f"; {later[0][0].name!r} at line {later[0][1].line} writes it, but later or elsewhere"
        prefix = demand.key.rpartition("/")[0]
        written = sorted(
            key
            for key, variable in self._variables.keys.items()
            if "@" not in key.removeprefix(prefix) and self._sets.values(asked, variable) - {UNSET}
        )
        names = [k.rpartition("/")[2] for k in written if k.rpartition("/")[0] == prefix]
        near = Findings.near(demand.key.rpartition("/")[2], names)
        valid = ", ".join(near) + (f" and {len(names) - len(near)} more" if len(names) > len(near) else "")
        valid = valid or "no key is written yet"
        if prefix and (outer := [k for k in written if "/" not in k]):
            valid += f"; of the caller, to be wired with ports: {', '.join(outer)}"
        hint = self._findings.nearest(demand.key.rpartition("/")[2], names)
        path = self._path(flow, demand, {UNSET})
        self._findings.add(demand.place, "port_unset", what, valid=valid, hint=hint, path=path, node=demand.node.name)

    def _wrong_kind(self, flow: Flow, demand: Demand, kind: Kind, values: set[int]) -> None:
        held = {self._variables.kind(demand.key, v) for v in values}
        writer = next(((n, p) for n, p, kinds in self._writers.get(demand.key, []) if held & set(kinds)), None)
        by = f"{writer[0].name!r} (line {writer[1].line})" if writer else "another node"
        path = self._path(flow, demand, values)
        if kind.unit and demand.unit and kind.unit != demand.unit:
            what = f"{_reader(demand)} in {demand.unit}, but {by} writes it in {kind.unit}"
            if not same_quantity(kind.unit, demand.unit):
                what += ": another quantity"
            self._findings.add(demand.place, "port_unit", what, path=path, node=demand.node.name)
            return
        wanted, given = _type_name(demand.wanted), _type_name(kind.data_type)
        if wanted == given:  # what differs is inside
            wanted, given = f"{wanted} of {demand.element.__name__}", f"{given} of {kind.element.__name__}"
        what = f"{_reader(demand)} as {wanted}, but {by} writes {given}"
        self._findings.add(demand.place, "port_type", what, path=path, node=demand.node.name)

    def _wrong_state(self, flow: Flow, demand: Demand, bad: frozenset[int], *, always: bool) -> None:
        names = self._variables.state_names(demand.key)
        may = "is" if always else "may be"
        what = f"{demand.node.name!r} starts while the {demand.key} {may} {_states(names, bad)}"
        path = self._path(flow, demand, set(bad))
        valid = ", ".join(sorted(demand.wanted))
        self._findings.add(demand.place, "wrong_state", what, valid=valid, path=path, node=demand.node.name)

    def _path(self, flow: Flow, demand: Demand, wrong: set[int]) -> tuple[str, ...]:
        return self._search(flow, Goal(demand.node, demand.port, demand.variable, frozenset(wrong)))

    def _search(self, flow: Flow, goal: Goal) -> tuple[str, ...]:
        self._paths += 1
        return shortest_path(flow, goal, self._patience) if self._paths <= MAX_PATHS else ()

    # -- the rest ----------------------------------------------------------------------------------------------------

    def _least_first(self, node: NodeSpec) -> None:
        settings = node.settings
        if not isinstance(settings, ForEachSettings) or settings.least_first is None or "items" not in node.reads:
            return
        key = node.reads["items"].key
        kinds = {k for _, _, found in self._writers.get(key, []) for k in found}
        elements = {k.element for k in kinds} - {object}
        element = elements.pop() if len(elements) == 1 else object
        if element is not object and settings.least_first not in _fields(element):
            kind = f"field of {element.__name__}:"
            self._findings.unknown(node.place, "unknown_field", kind, settings.least_first, _fields(element))

    def _unreachable(self, node: NodeSpec) -> None:
        """The topmost nodes that are never entered."""
        for i, child in enumerate(node.children):
            if self._lenient.entered.get(id(child), EMPTY) == EMPTY:
                before = node.children[i - 1] if i else node
                word = "succeeds" if node.kind == "selector" else "fails"
                what = f"{child.name!r} can never be reached: {before.name!r} (line {before.place.line}) always {word}"
                self._findings.add(child.place, "unreachable", what, node=child.name)
                return
            self._unreachable(child)

    def _end(self, leaves: Mapping[str, tuple[frozenset[str], Place]]) -> None:
        end, variables = self._exact.end.success, self._variables
        tree = self._exact.tree
        if not len(self._findings):  # how a mission with a mistake in it ends says little
            self._outcomes()
        for resource, variable in variables.resources.items():
            found = self._sets.values(end, variable)
            names = variables.state_names(resource)
            if resource in leaves:
                wanted, place = leaves[resource]
                for state in sorted(wanted - set(names)):
                    self._findings.unknown(place, "unknown_state", f"state of the {resource}:", state, names)
                if not wanted & set(names):
                    continue
                bad = frozenset(v for v in found if names[v] not in wanted)
                if bad:
                    what = f"the mission may end in success with the {resource} {_states(names, bad)}"
                    path = self._search(self._exact, Goal(None, "", variable, bad))
                    self._findings.add(place, "wrong_end", what, valid=", ".join(sorted(wanted)), path=path)
                continue
            for node in tree.walk():
                skill = node.skill_type
                if skill is None or resource not in skill.RESTORED_BY:
                    continue
                left = skill.POSTCONDITIONS[resource]
                value = variables.state(resource, left)
                if value in found:
                    what = f"the mission may end in success with the {resource} {left!r}, taken by {node.name!r}"
                    back = skill.RESTORED_BY[resource]
                    valid = f"{back} before the end, or `leaves: {{{resource}: {left}}}` at the top"
                    path = self._search(self._exact, Goal(None, "", variable, frozenset({value})))
                    self._findings.add(node.place, "not_put_back", what, valid=valid, path=path, node=node.name)
                    break
        for resource, (_, place) in leaves.items():
            if resource not in variables.resources:
                self._findings.unknown(place, "unknown_resource", "resource:", resource, variables.resources)

    def _outcomes(self) -> None:
        end, tree = self._exact.end, self._exact.tree
        if end.success == EMPTY and end.failure != EMPTY:
            self._findings.add(tree.place, "never_succeeds", "no run of this mission ends in success")
        elif end.failure == EMPTY and end.success != EMPTY and any(n.kind == "skill" for n in tree.walk()):
            what = "the mission ends in success whatever its skills do"
            self._findings.add(tree.place, "never_fails", what)


def _writers(tree: NodeSpec, variables: Variables) -> dict[str, list[tuple[NodeSpec, Place, list[Kind]]]]:
    """Who writes each key, where it says so, and what kinds of values."""
    found: dict[str, list[tuple[NodeSpec, Place, list[Kind]]]] = {}
    for node in tree.walk():
        for port, wire in node.writes.items():
            if node.skill_type is not None:
                kinds = written_kinds(node, port)
            elif port == "item" and "items" in node.reads:
                items = node.reads["items"].key
                kinds = [item_kind(variables.kind(items, v)) for v in variables.written(items)]
            elif port in node.reads:
                source = node.reads[port].key
                kinds = [gathered_kind({variables.kind(source, v): None}) for v in variables.written(source)]
            else:
                kinds = [variables.kind(wire.key, v) for v in variables.written(wire.key)]
            found.setdefault(wire.key, []).append((node, wire.place, kinds))
    return found


def _states(names: Sequence[str], values: frozenset[int]) -> str:
    return " or ".join(repr(names[v]) for v in sorted(values))


def _fields(kind: type) -> list[str]:
    """What values of a type can be put in order by: their public numbers and texts, as far as types are said."""
    hints = _hints(kind)
    for name in dir(kind):
        attribute = inspect.getattr_static(kind, name)
        if isinstance(attribute, property):
            hints.setdefault(name, _hints(attribute.fget).get("return", object))
        elif not callable(attribute):
            hints.setdefault(name, type(attribute))
    return [n for n, hint in hints.items() if not n.startswith("_") and hint in (int, float, bool, str, object, Any)]


def _hints(thing: Any) -> dict[str, Any]:
    try:
        return get_type_hints(thing)
    except (NameError, TypeError):  # a name that only type checkers import
        return dict.fromkeys(getattr(thing, "__annotations__", ()), object)


def _reader(demand: Demand) -> str:
    name = demand.key.rsplit("/", 1)[-1]
    port = f"port {demand.port!r}" if demand.port == name else f"port {demand.port!r} (key {name!r})"
    return f"{demand.node.name!r} reads {port}"


def _type_name(wanted: Any) -> str:
    return getattr(wanted, "__name__", str(wanted))
