"""Slips a person makes in a mission, made on purpose: every mutant of a tree, each with the place it changes.

Mutants are made of the checked tree, so that they reach into subtrees' files too and keep their places. What stands in
one place of a file is changed wherever that file is used, as a slip there would.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from glotouch_bt.mission import Mission
from glotouch_bt.mission.check import check_flow
from glotouch_bt.mission.spec import (
    KINDS,
    ConditionSettings,
    Finding,
    Findings,
    ForEachSettings,
    NodeSpec,
    ParallelSettings,
    Place,
    Plain,
    RepeatSettings,
    RetrySettings,
    Settings,
    TimeoutSettings,
    Wire,
)

Change = Callable[[NodeSpec], NodeSpec]
Slip = tuple[str, Place, str, Change]
Keys = Mapping[Any, list[str]]
TURNS = ("invert", "succeed", "fail")
"""Nodes that change a result."""


@dataclass(frozen=True)
class Mutant:
    """One slip.

    Attributes:
        operator: Its class: composite, drop, unwrap, wrap, order, bound, key, on_failure, constant, parameter.
        place: Where it was made.
        what: What was done, for a person.
        target: Place and kind of the changed node.
        change: The node to what it becomes.
    """

    operator: str
    place: Place
    what: str
    target: tuple[Place, str]
    change: Change

    def apply(self, node: NodeSpec) -> NodeSpec:
        """The tree with this slip in it."""
        children = tuple(map(self.apply, node.children))
        if any(new is not old for new, old in zip(children, node.children, strict=True)):
            node = replace(node, children=children)
        return self.change(node) if (node.place, node.kind) == self.target else node


def findings_of(mission: Mission, tree: NodeSpec) -> list[Finding]:
    """The faults `glotouch check` finds when a mission has another tree."""
    findings = Findings()
    promised: Mapping[str, Any] = mission.document.get("leaves") or {}
    leaves = {
        resource: (frozenset([states] if isinstance(states, str) else states), mission.tree.place)
        for resource, states in promised.items()
    }
    check_flow(tree, findings, leaves, mission.timeout_s)
    return findings.errors


def mutants_of(root: NodeSpec) -> Iterator[Mutant]:
    """Every mutant of a tree that differs from it and from those before."""
    seen, visited = {signature(root)}, set()
    parents = {id(child): node for node in root.walk() for child in node.children}
    keys = _keys_by_type(root)
    for node in root.walk():
        target = (node.place, node.kind)
        if target in visited:
            continue
        visited.add(target)
        for operator, place, what, change in _changes(node, parents.get(id(node)), keys):
            mutant = Mutant(operator, place, what, target, change)
            made = signature(mutant.apply(root))
            if made not in seen:
                seen.add(made)
                yield mutant


def signature(node: NodeSpec) -> tuple[Any, ...]:
    """What a tree does, as a value that can be compared."""
    wires = tuple(tuple(sorted((p, w.key) for p, w in ports.items())) for ports in (node.reads, node.writes))
    name = node.name if node.kind == "skill" else ""
    below = tuple(signature(c) for c in node.children)
    return node.kind, name, repr(node.settings), repr(node.params), wires, repr(dict(node.constants)), below


def _changes(node: NodeSpec, parent: NodeSpec | None, keys: Keys) -> Iterator[Slip]:
    many = KINDS[node.kind].children == "many" if node.kind in KINDS else False
    if many and len(node.children) > 1:
        yield from _composite(node)
    if node.kind in KINDS and KINDS[node.kind].children == "one":
        yield "unwrap", node.place, f"{node.kind} {node.name!r} dropped, its child stays", lambda n: n.children[0]
    if parent is not None:
        # Where the node above replaces the result, turning it changes nothing.
        for kind in () if parent.kind in ("succeed", "fail") else TURNS:
            if kind != node.kind:
                yield "wrap", node.place, f"{node.name!r} put below {kind}", _wrapped(kind)
    yield from _bounds(node)
    yield from _constants(node)
    yield from _rewired(node, keys)
    yield from _parameters(node)


def _wrapped(kind: str) -> Change:
    return lambda n: NodeSpec(kind, f"{kind} {n.name}", n.place, (n,), Plain())


def _composite(node: NodeSpec) -> Iterator[Slip]:
    other = {"sequence": "selector", "selector": "sequence", "parallel": "sequence"}[node.kind]
    settings: Settings = Plain()
    yield (
        "composite",
        node.place,
        f"{node.kind} {node.name!r} becomes a {other}",
        lambda n: replace(n, kind=other, settings=settings),
    )
    for i, child in enumerate(node.children):
        yield "drop", child.place, f"{child.name!r} dropped from {node.kind} {node.name!r}", _without(i)
    for i, (one, two) in enumerate(zip(node.children, node.children[1:], strict=False)):
        if node.kind != "parallel":
            yield "order", one.place, f"{one.name!r} and {two.name!r} change places", _exchanged(i)


def _without(i: int) -> Change:
    return lambda n: replace(n, children=n.children[:i] + n.children[i + 1 :])


def _exchanged(i: int) -> Change:
    return lambda n: replace(n, children=(*n.children[:i], n.children[i + 1], n.children[i], *n.children[i + 2 :]))


def _set(**values: Any) -> Change:
    def change(node: NodeSpec) -> NodeSpec:
        assert node.settings is not None
        return replace(node, settings=node.settings.model_copy(update=values))

    return change


def _bounds(node: NodeSpec) -> Iterator[Slip]:
    s = node.settings
    if isinstance(s, RetrySettings):
        yield from _stepped(node, "attempts", s.attempts, 2)  # one attempt is no retry: that is `unwrap`
    if isinstance(s, RepeatSettings):
        name = "times" if s.times is not None else "limit"
        yield from _stepped(node, name, s.limit if s.times is None else s.times, 1)
    if isinstance(s, TimeoutSettings):
        for factor in (0.5, 2.0):
            yield (
                "bound",
                node.place,
                f"{node.name!r}: seconds {s.seconds:g} becomes {s.seconds * factor:g}",
                _set(seconds=s.seconds * factor),
            )
    if isinstance(s, ParallelSettings):
        policy = "one" if s.policy == "all" else "all"
        yield "bound", node.place, f"{node.name!r}: policy becomes {policy}", _set(policy=policy)
    if isinstance(s, ForEachSettings):
        on_failure = "stop" if s.on_failure == "continue" else "continue"
        yield "on_failure", node.place, f"{node.name!r}: on_failure becomes {on_failure}", _set(on_failure=on_failure)
        if s.least_first is not None:
            yield "on_failure", node.place, f"{node.name!r}: least_first dropped", _set(least_first=None)


def _stepped(node: NodeSpec, name: str, value: int, least: int) -> Iterator[Slip]:
    for new in (value - 1, value + 1):
        if new >= least:
            yield "bound", node.place, f"{node.name!r}: {name} {value} becomes {new}", _set(**{name: new})


def _constants(node: NodeSpec) -> Iterator[Slip]:
    if isinstance(node.settings, ConditionSettings):
        for words, values in _comparisons(node.settings):
            yield "constant", node.place, f"{node.name!r}: {words}", _set(**values)
    until = getattr(node.settings, "until", None)
    if isinstance(until, ConditionSettings):
        for words, values in _comparisons(until):
            yield "constant", node.place, f"{node.name!r}: until {words}", _set(until=until.model_copy(update=values))


def _comparisons(s: ConditionSettings) -> Iterator[tuple[str, dict[str, Any]]]:
    if s.is_set is not None:
        yield f"is_set becomes {not s.is_set}".lower(), {"is_set": not s.is_set}
    if isinstance(s.equals, bool):
        yield f"equals becomes {not s.equals}".lower(), {"equals": not s.equals}
    elif isinstance(s.equals, (int, float)):
        yield f"equals {s.equals:g} becomes {s.equals + 1:g}", {"equals": s.equals + 1}
    elif s.equals is not None:
        yield f"equals {s.equals!r} becomes another text", {"equals": f"not {s.equals}"}
    for name, other in (("at_least", "at_most"), ("at_most", "at_least")):
        value = getattr(s, name)
        if value is None:
            continue
        step = 1.0 if float(value).is_integer() and value else 0.1 * abs(value) or 1.0
        for new in (value - step, value + step):
            yield f"{name} {value:g} becomes {new:g}", {name: new}
        yield f"{name} becomes {other}", {name: None, other: value}


def _rewired(node: NodeSpec, keys: Keys) -> Iterator[Slip]:
    """Each wire the mission writes out, put to another key of its type, or to one that nobody else uses."""
    for side, wires in (("reads", node.reads), ("writes", node.writes)):
        for port, wire in wires.items():
            if wire.place == node.place or port in node.constants:
                continue
            words = f"{node.name!r}: {port} {_local(wire.key)!r} becomes {_local(_other(wire.key, keys))!r}"
            yield "key", wire.place, words, _with_wire(side, port, keys)


def _with_wire(side: str, port: str, keys: Keys) -> Change:
    def other(wire: Wire) -> Wire:
        return replace(wire, key=_other(wire.key, keys))

    if side == "reads":
        return lambda n: replace(n, reads={**n.reads, port: other(n.reads[port])})
    return lambda n: replace(n, writes={**n.writes, port: other(n.writes[port])})


def _other(key: str, keys: Keys) -> str:
    """The first other key of the same type in the same file, else of the mission, else a new one."""
    same_type = next((names for names in keys.values() if key in names), [])
    others = [k for k in same_type if k != key]
    beside = [k for k in others if k.rpartition("/")[0] == key.rpartition("/")[0]]
    return next(iter([*beside, *others]), f"{key}_elsewhere")


def _local(key: str) -> str:
    return key.rpartition("/")[2]


def _keys_by_type(root: NodeSpec) -> dict[Any, list[str]]:
    """Keys that skills and loops write, by the type of their value."""
    found: dict[Any, dict[str, None]] = {}
    for node in root.walk():
        for port, wire in node.writes.items():
            kind: Any = object
            if node.skill_type is not None:
                kind = node.skill_type.OUTPUT_PORTS[port].data_type
            elif node.kind == "for_each" and port != "item":
                kind = tuple
            found.setdefault(kind, {})[wire.key] = None
    return {k: list(names) for k, names in found.items()}


def _parameters(node: NodeSpec) -> Iterator[Slip]:
    """Each parameter the mission sets, left to its default."""
    params = node.params
    if params is None:
        return
    for name in sorted(params.model_fields_set):
        field = type(params).model_fields[name]
        if not field.is_required():
            yield "parameter", node.place, f"{node.name!r}: {name} left to its default", _defaulted(name, field.default)


def _defaulted(name: str, value: Any) -> Change:
    def change(node: NodeSpec) -> NodeSpec:
        assert node.params is not None
        return replace(node, params=node.params.model_copy(update={name: value}))

    return change
