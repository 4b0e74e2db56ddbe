"""Turn the analysis of a tree into findings: inputs that are missing or wrong, unreachable nodes, wrong ends."""

from __future__ import annotations

import dataclasses
import inspect
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, get_type_hints

from glotouch_bt.mission.check.counterexample import Goal, StepBudget, shortest_path
from glotouch_bt.mission.check.data_flow import DataFlow
from glotouch_bt.mission.check.lint import check_lint
from glotouch_bt.mission.check.live_variables import followed
from glotouch_bt.mission.check.requirements import Requirements, all_requirements
from glotouch_bt.mission.check.variables_of import variables_of
from glotouch_bt.mission.nodes import (
    ANYTHING,
    EMPTY,
    UNSET,
    Requirement,
    StateSets,
    StateVariables,
    ValueKind,
    ValueSets,
    kind_of,
)
from glotouch_bt.mission.spec import Findings, NodeSpec, Place, base_of
from glotouch_bt.robot import BadInput
from glotouch_bt.skill import Skill

MAX_PATHS = 40
"""Number of findings that are reported with a path; later ones come without."""
MAX_RECURSION = 50_000
"""Recursion limit of the interpreter while the sets are computed: they recurse as deep as there are keys."""


def check_flow(
    tree: NodeSpec,
    skills: Mapping[str, type[Skill]],
    findings: Findings,
    leaves: Mapping[str, tuple[frozenset[str], Place]],
    timeout_s: float,
) -> None:
    """Report what can go wrong on some run of a tree.

    Args:
        tree: Its root, names numbered.
        skills: Known skills, to say which of them writes a key.
        findings: Where faults go.
        leaves: States in which the mission promises to leave resources after success, and the place of the promise.
        timeout_s: Longest duration of the mission.
    """
    with _deep_recursion():
        variables = variables_of(tree)
        requirements = all_requirements(tree, variables)
        # Most trees have no fault. That is known long before all keys have been followed.
        if not any(kind_of(n).is_unknown(n) for n in tree.walk()):
            flow, none = projected(tree, variables, requirements), Findings()
            _Rules(flow, flow, skills, none, StepBudget(0)).all(leaves)
            check_lint(flow, none, timeout_s)
            if not none.sorted():
                return
        exact = DataFlow(tree, variables, requirements)
        blocked = any(id(n) not in exact.entered for n in tree.walk())
        lenient = DataFlow(tree, variables, requirements, exact.sets, lenient=True) if blocked else exact
        _Rules(exact, lenient, skills, findings, StepBudget()).all(leaves)
        check_lint(lenient, findings, timeout_s)


def projected(tree: NodeSpec, variables: StateVariables, requirements: Requirements) -> DataFlow:
    """Return an analysis that follows only the variables on which the course of a run may depend.

    No other variable ever stops a node or decides a comparison, whatever its value, so its projection is exact: the
    same nodes are entered, and end in the same ways, as with all variables.
    """
    coarse = DataFlow(tree, variables, requirements, ValueSets(variables.sizes))
    sets = StateSets(variables.sizes, None if any(kind_of(n).concurrent for n in tree.walk()) else followed(coarse))
    return DataFlow(tree, variables, requirements, sets, coarse=coarse)


@contextmanager
def _deep_recursion() -> Iterator[None]:
    """Raise the recursion limit; see `nodes.base.state_sets`."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, MAX_RECURSION))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)


class _Rules:
    """Nodes that some run enters are judged by the exact sets, nodes after a mistake by the lenient ones."""

    def __init__(
        self,
        exact: DataFlow,
        lenient: DataFlow,
        skills: Mapping[str, type[Skill]],
        findings: Findings,
        budget: StepBudget,
    ) -> None:
        self._exact, self._lenient, self._skills, self._findings = exact, lenient, skills, findings
        self._variables, self._sets = exact.variables, exact.sets
        self._writers = _writers(exact.tree, exact.variables)
        self._paths, self._budget = 0, budget
        self._unwritten: dict[str, list[Requirement]] = {}  # optional inputs, by the name of their key

    def all(self, leaves: Mapping[str, tuple[frozenset[str], Place]]) -> None:
        for node in self._exact.tree.walk():
            for requirement in self._exact.requirements[id(node)]:
                self._requirement(requirement)
            self._ordered_by(node)
        self._never_written_inputs()
        self._unreachable(self._exact.tree)
        self._end(leaves)

    # -- keys and resources ------------------------------------------------------------------------------------------

    def _requirement(self, requirement: Requirement) -> None:
        flow = self._exact if requirement in self._exact.looked else self._lenient
        found = flow.found(requirement)
        if not found:
            return
        if requirement.unset == "not always":  # a key that only an earlier mistake leaves unwritten is no mistake here
            found |= self._lenient.found(requirement) - {ANYTHING}
        wrong = found - requirement.good - {UNSET}
        if requirement.of_resource:
            if bad := found - requirement.good:
                self._wrong_state(flow, requirement, bad, always=not found & requirement.good)
            return
        skill = requirement.node.skill_type
        optional = requirement.unset == "allowed" and skill is not None and getattr(skill, requirement.port).expected
        if optional and not self._exact.has_unknown and not self._writers.get(requirement.key):
            self._unwritten.setdefault(requirement.key.rpartition("/")[2], []).append(requirement)
        if self._never_written(requirement, found):
            self._unset(flow, requirement)
        elif UNSET in found and UNSET not in requirement.good:
            by = ", ".join(f"{n.name!r} (line {p.line})" for n, p in self._places(requirement))
            what = f"{_reader(requirement)}, which is written only on some paths to it, by {by}"
            path = self._path(flow, requirement, {UNSET})
            self._findings.add(requirement.place, "port_maybe_unset", what, path=path, node=requirement.node.name)
        alike: dict[ValueKind, set[int]] = {}  # kinds that differ only in their value are one mistake
        for value in sorted(wrong):
            alike.setdefault(dataclasses.replace(self._variables.kind(requirement.key, value), value=None), set()).add(
                value
            )
        for kind, values in alike.items():
            self._wrong_kind(flow, requirement, kind, values)

    def _never_written_inputs(self) -> None:
        """Report optional inputs that no node writes, once for each name of a key."""
        for name, requirements in self._unwritten.items():
            readers = " and ".join(dict.fromkeys(repr(r.node.skill) for r in requirements))
            what = f"no node writes {name!r}, an optional input of {readers}"
            node = requirements[0].node
            self._findings.add(requirements[0].place, "input_never_written", what, node=node.name)

    def _never_written(self, requirement: Requirement, found: frozenset[int]) -> bool:
        if requirement.unset == "allowed":
            # A test of `is_set` makes sense only if some node writes the key.
            tested = not requirement.node.children and kind_of(requirement.node).comparison(requirement.node)
            return bool(tested) and not self._writers.get(requirement.key)
        return found == {UNSET}

    def _places(self, requirement: Requirement) -> list[tuple[NodeSpec, Place]]:
        """Return the writers of a key with their places, each once, the reader itself last."""
        found = {n.name: (n, p) for n, p, _ in self._writers.get(requirement.key, [])}
        return sorted(found.values(), key=lambda w: (w[0] is requirement.node, w[1]))

    def _unset(self, flow: DataFlow, requirement: Requirement) -> None:
        what = f"{_reader(requirement)}, which no node writes before it"
        name = requirement.key.rpartition("/")[2]
        inside = {k.partition("@")[0] for k in self._writers if k != requirement.key and k.rpartition("/")[2] == name}
        for subtree in sorted(inside - {name}):
            what += f"; subtree {subtree!r} keeps its own {name!r} to itself, unless it is wired with ports"
        later = [(n, p) for n, p in self._places(requirement) if n is not requirement.node]
        if later:
            what += f"; {later[0][0].name!r} at line {later[0][1].line} writes it, but later or elsewhere"
        elif able := _skills_that_write(name, self._skills, requirement.node.skill):
            what += f"; skills that write it: {', '.join(able)}"
        prefix, looked = requirement.key.rpartition("/")[0], flow.judged(requirement)
        written = sorted(
            key
            for key, variable in self._variables.keys.items()
            if "@" not in key.removeprefix(prefix) and self._sets.values(looked, variable) - {UNSET}
        )
        names = [k.rpartition("/")[2] for k in written if k.rpartition("/")[0] == prefix]
        valid = Findings.listed(requirement.key.rpartition("/")[2], names) or "no key is written yet"
        if prefix and (outer := [k for k in written if "/" not in k]):
            valid += f"; of the caller, to be wired with ports: {', '.join(outer)}"
        hint = self._findings.nearest(requirement.key.rpartition("/")[2], names)
        path = self._path(flow, requirement, {UNSET})
        self._findings.add(
            requirement.place, "port_unset", what, valid=valid, hint=hint, path=path, node=requirement.node.name
        )

    def _wrong_kind(self, flow: DataFlow, requirement: Requirement, kind: ValueKind, values: set[int]) -> None:
        held = {self._variables.kind(requirement.key, v) for v in values}
        writer = next(((n, p) for n, p, kinds in self._writers.get(requirement.key, []) if held & set(kinds)), None)
        by = f"{writer[0].name!r} (line {writer[1].line})" if writer else "another node"
        path = self._path(flow, requirement, values)
        if kind.unit and requirement.unit and kind.unit != requirement.unit:
            what = f"{_reader(requirement)} in {requirement.unit}, but {by} writes it in {kind.unit}"
            if base_of(kind.unit) != base_of(requirement.unit):
                what += ": another quantity"
            self._findings.add(requirement.place, "port_unit", what, path=path, node=requirement.node.name)
            return
        wanted, given = _type_name(requirement.wanted), _type_name(kind.data_type)
        if wanted == given:  # what differs is inside
            wanted, given = f"{wanted} of {requirement.element.__name__}", f"{given} of {kind.element.__name__}"
        what = f"{_reader(requirement)} as {wanted}, but {by} writes {given}"
        self._findings.add(requirement.place, "port_type", what, path=path, node=requirement.node.name)

    def _wrong_state(self, flow: DataFlow, requirement: Requirement, bad: frozenset[int], *, always: bool) -> None:
        names = self._variables.state_names(requirement.key)
        may = "is" if always else "may be"
        what = f"{requirement.node.name!r} starts while the {requirement.key} {may} {_states(names, bad)}"
        path = self._path(flow, requirement, set(bad))
        valid = ", ".join(sorted(requirement.wanted))
        self._findings.add(requirement.place, "wrong_state", what, valid=valid, path=path, node=requirement.node.name)

    def _path(self, flow: DataFlow, requirement: Requirement, wrong: set[int]) -> tuple[str, ...]:
        return self._search(flow, Goal(requirement.node, requirement.port, requirement.variable, frozenset(wrong)))

    def _search(self, flow: DataFlow, goal: Goal) -> tuple[str, ...]:
        self._paths += 1
        return shortest_path(flow, goal, self._budget) if self._paths <= MAX_PATHS else ()

    # -- the rest ----------------------------------------------------------------------------------------------------

    def _ordered_by(self, node: NodeSpec) -> None:
        found = kind_of(node).ordered_by(node)
        if found is None:
            return
        key, field = found
        kinds = {k for _, _, found in self._writers.get(key, []) for k in found}
        elements = {k.element for k in kinds} - {object}
        element = elements.pop() if len(elements) == 1 else object
        if element is not object and field not in _fields(element):
            kind = f"field of {element.__name__}:"
            self._findings.unknown(node.place, "unknown_field", kind, field, _fields(element))

    def _unreachable(self, node: NodeSpec) -> None:
        """Report the topmost nodes that are never entered."""
        for i, child in enumerate(node.children):
            if id(child) not in self._lenient.entered:
                before = node.children[i - 1] if i else node
                word = "fails" if kind_of(node).continue_on else "succeeds"
                what = f"{child.name!r} can never be reached: {before.name!r} (line {before.place.line}) always {word}"
                self._findings.add(child.place, "unreachable", what, node=child.name)
                return
            self._unreachable(child)

    def _end(self, leaves: Mapping[str, tuple[frozenset[str], Place]]) -> None:
        end, variables = self._exact.end.success, self._variables
        tree = self._exact.tree
        if not len(self._findings):  # with a mistake in it, the end of a mission says little
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
        elif end.failure == EMPTY and end.success != EMPTY and any(n.skill_type is not None for n in tree.walk()):
            what = "the mission ends in success whatever its skills do"
            self._findings.add(tree.place, "never_fails", what)


def _writers(tree: NodeSpec, variables: StateVariables) -> dict[str, list[tuple[NodeSpec, Place, list[ValueKind]]]]:
    """Return, for each key, its writers, their places, and the kinds of values they write."""
    found: dict[str, list[tuple[NodeSpec, Place, list[ValueKind]]]] = {}
    for node in tree.walk():
        for port, wire in node.writes.items():
            kinds = kind_of(node).written_kinds(node, port, variables.written_kinds)
            found.setdefault(wire.key, []).append((node, wire.place, kinds))
    return found


def _skills_that_write(key: str, skills: Mapping[str, type[Skill]], reader: str) -> list[str]:
    """Return the skills other than the reader that write a key of this name unless a mission rewires them."""
    found = []
    for name in skills:
        try:
            skill = skills[name]
        except BadInput:  # its module cannot be imported here
            continue
        keys = skill.default_keys()
        if name != reader and key in (keys[port] for port in skill.OUTPUT_PORTS):
            found.append(name)
    return found


def _states(names: Sequence[str], values: frozenset[int]) -> str:
    return " or ".join(repr(names[v]) for v in sorted(values))


def _fields(kind: type) -> list[str]:
    """Return the public attributes of a type that are numbers or texts, as far as types are declared."""
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


def _reader(requirement: Requirement) -> str:
    name = requirement.key.rsplit("/", 1)[-1]
    port = f"port {requirement.port!r}" if requirement.port == name else f"port {requirement.port!r} (key {name!r})"
    return f"{requirement.node.name!r} reads {port}"


def _type_name(wanted: Any) -> str:
    return getattr(wanted, "__name__", str(wanted))
