"""A skill: the leaf that moves the robot, written by its own name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any, Literal

from py_trees.behaviour import Behaviour

from glotouch_bt.mission.nodes.base import (
    EMPTY,
    BtcppForm,
    BuildContext,
    DataFlowAnalysis,
    ExitStates,
    NodeKind,
    PathSearch,
    Position,
    Requirement,
    RunCount,
    Stack,
    StateVariables,
    ValueKind,
    Values,
    btcpp_key,
    btcpp_value,
    port_requirement,
    set_values,
)
from glotouch_bt.mission.spec import NodeSpec, unit_of_name
from glotouch_bt.robot import GlotouchError
from glotouch_bt.skill import UNCHANGED, Skill

RESULTS = ("success", "failure", "running")


def written_kind(node: NodeSpec, port: str, result: str) -> ValueKind:
    """Return the kind of what a skill writes to a port, given its result (running: it is preempted)."""
    assert node.skill_type is not None
    declared = getattr(node.skill_type, port, None)
    element = getattr(declared, "element", None) or object
    value = getattr(declared, f"on_{result}", None)
    return ValueKind(node.skill_type.OUTPUT_PORTS[port].data_type, element, unit_of_name(port), value)


Change = tuple[int, tuple[int, ...], bool]
"""A variable, its possible values afterwards, and whether it may be as before, too."""


def _changes(node: NodeSpec, variables: StateVariables) -> tuple[list[Change], list[Change], list[Change]]:
    """Return what a skill changes in success, in failure, and until it is preempted."""
    skill = _skill_of(node)
    success: list[Change] = []
    failure: list[Change] = []
    running: list[Change] = []
    for port, wire in node.writes.items():
        key = variables.keys[wire.key]
        good, bad, part = (variables.value(wire.key, written_kind(node, port, result)) for result in RESULTS)
        success.append((key, (good,), False))
        failure.append((key, (bad,), not _always_writes(skill, port)))
        running.append((key, (part,), True))
    for resource, variable in variables.resources.items():
        leaves = skill.POSTCONDITIONS.get(resource)
        after = skill.FAILURE_STATES.get(resource, frozenset({UNCHANGED, leaves or UNCHANGED}))
        failed = tuple(variables.state(resource, s) for s in after - {UNCHANGED})
        left = () if leaves is None else (variables.state(resource, leaves),)
        if left:
            success.append((variable, left, False))
        if failed or left:
            failure.append((variable, failed, UNCHANGED in after))
            running.append((variable, (*failed, *left), True))
    return success, failure, running


class SkillKind(NodeKind):
    """Run one skill."""

    name = "skill"
    description = "a skill"
    children = "none"
    sign, fill = "■", "#e3eefb"

    def written_kinds(self, node: NodeSpec, port: str, held: Callable[[str], list[ValueKind]]) -> list[ValueKind]:
        """Return what it writes with each result, each kind once."""
        return list(dict.fromkeys(written_kind(node, port, result) for result in RESULTS))

    def effects(self, node: NodeSpec, variables: StateVariables) -> Iterator[tuple[int, set[int]]]:
        """Yield what it writes, and the states in which it leaves resources."""
        skill = _skill_of(node)
        for port, wire in node.writes.items():
            kinds = self.written_kinds(node, port, lambda _: [])
            yield variables.keys[wire.key], {variables.value(wire.key, k) for k in kinds}
        for resource in {*skill.POSTCONDITIONS, *skill.FAILURE_STATES}:
            after = {*skill.FAILURE_STATES.get(resource, ()), skill.POSTCONDITIONS.get(resource, UNCHANGED)}
            yield variables.resources[resource], {variables.state(resource, s) for s in after - {UNCHANGED}}

    def requirements(self, node: NodeSpec, variables: StateVariables) -> Iterator[Requirement]:
        """Yield those of its inputs, then its preconditions."""
        skill = _skill_of(node)
        for port, wire in node.reads.items():
            if port in node.constants:
                continue
            info = skill.INPUT_PORTS[port]
            # An optional input may stay unwritten, unless the mission wired it on purpose.
            optional: Literal["not always", "allowed"] = "allowed" if wire.place == node.place else "not always"
            unset = "never" if info.required else optional
            element = getattr(getattr(skill, port, None), "element", None) or object
            yield port_requirement(node, port, variables, unset, info.data_type, unit_of_name(port), element)
        for resource, states in skill.PRECONDITIONS.items():
            good = frozenset(variables.state(resource, s) for s in states)
            variable = variables.resources[resource]
            yield Requirement(node, resource, resource, variable, node.place, good, "allowed", frozenset(states))

    def required_keys(self, node: NodeSpec) -> list[str]:
        """Return those of its required inputs."""
        ports = _skill_of(node).INPUT_PORTS
        return [w.key for p, w in node.reads.items() if ports[p].required and p not in node.constants]

    def exits(self, flow: DataFlowAnalysis, node: NodeSpec, entry: int) -> ExitStates:
        """Assume that the skill may succeed, fail, and be preempted, in any state that meets its requirements."""
        sets, requirements = flow.sets, flow.requirements[id(node)]
        if id(node) not in flow.facts:  # a variable that is not followed changes nothing
            needs = [r for r in requirements if sets.follows(r.variable)]
            flow.facts[id(node)] = needs, *(sets.changes(c) for c in _changes(node, flow.variables))
        needs, success, failure, running = flow.facts[id(node)]
        flow.note(requirements, entry)
        for requirement in needs:
            entry = flow.meeting(entry, requirement)
        during = sets.write(entry, running) if flow.preemptible(node) else EMPTY
        return ExitStates(sets.write(entry, success), sets.write(entry, failure), during)

    def step(
        self, search: PathSearch, node: NodeSpec, stack: Stack, values: Values, memory: Any
    ) -> Iterator[tuple[str, Position]]:
        """Yield its success, its failure, and every preemption by a node above it."""
        if not search.meets(node, values):
            return
        for made in _left(search, node, values, "success"):
            for there in search.leave(stack, True, made):
                yield f"{node.name} ok", there
        for made in _left(search, node, values, "failure"):
            for there in search.leave(stack, False, made):
                yield f"{node.name} fails", there
        for above, interrupter in search.interrupters(stack):
            for made in _left(search, node, values, "running"):
                for there in search.leave(above, False, made):
                    yield f"{node.name} is broken off by {interrupter.name}", there

    def max_runs(self, node: NodeSpec) -> RunCount:
        """Return one."""
        return RunCount((1,))

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return the skill with its ports wired and its constants written.

        Raises:
            GlotouchError: Its constructor raised.
        """
        assert node.params is not None
        try:
            skill = _skill_of(node)(node.name, node.params, made.context)
        except Exception as e:
            raise GlotouchError(f"skill {node.name!r} cannot be made: {type(e).__name__}: {e}") from e
        wiring = {p: f"{made.namespace}/{w.key}" for p, w in (*node.reads.items(), *node.writes.items())}
        skill.setup_ports(wiring)
        for port, value in node.constants.items():
            made.keys(node.name, node.reads[port].key).set(node.reads[port].key, value)
        return skill

    def label(self, node: NodeSpec) -> str:
        """Return the skill's name."""
        return node.skill

    def details(self, node: NodeSpec) -> list[str]:
        """Return its parameters, then the keys it reads and writes."""
        reads = ", ".join(p if p in node.constants else w.key for p, w in node.reads.items())
        writes = ", ".join(w.key for w in node.writes.values())
        return [*set_values(node.params), f"{reads or '·'} → {writes or '·'}"]

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it as an action with its ports and parameters."""
        constant = node.constants
        reads = {p: btcpp_value(constant[p]) if p in constant else btcpp_key(w.key) for p, w in node.reads.items()}
        writes = {p: btcpp_key(w.key) for p, w in node.writes.items()}
        values = node.params.model_dump(exclude_defaults=True) if node.params is not None else {}
        given = {**reads, **writes, **{n: btcpp_value(v) for n, v in values.items()}}
        return BtcppForm(node.skill, given, _skill_of(node).Params.model_fields)


def _skill_of(node: NodeSpec) -> type[Skill]:
    assert node.skill_type is not None
    return node.skill_type


def _always_writes(skill: type[Skill], port: str) -> bool:
    return bool(getattr(getattr(skill, port, None), "always", False))


def _left(search: PathSearch, node: NodeSpec, values: Values, result: str) -> Iterator[Values]:
    """Yield the values that a skill may leave, those that change least first."""
    skill, variables = _skill_of(node), search.variables
    choices: list[list[tuple[int, int] | None]] = []
    for port, wire in node.writes.items():
        variable = variables.keys[wire.key]
        if search.follows(variable):
            written = (variable, variables.value(wire.key, written_kind(node, port, result)))
            sure = result == "success" or (result == "failure" and _always_writes(skill, port))
            choices.append([written] if sure else [None, written])
    for resource, variable in variables.resources.items():
        if not search.follows(variable):
            continue
        leaves = skill.POSTCONDITIONS.get(resource)
        after = set(skill.FAILURE_STATES.get(resource, {UNCHANGED, leaves or UNCHANGED}))
        names = {leaves or UNCHANGED} if result == "success" else after
        if result == "running":
            names |= {UNCHANGED, leaves or UNCHANGED}
        kept: list[tuple[int, int] | None] = [None] if UNCHANGED in names else []
        changed = sorted(names - {UNCHANGED})
        choices.append([*kept, *((variable, variables.state(resource, n)) for n in changed)])
    for chosen in product(*choices):
        made = values
        for one in chosen:
            if one is not None:
                made = search.assign(made, *one)
        yield made
