"""Slips a person makes in a mission, made on purpose: every mutant of a tree, each with the place it changes.

Mutants are made of the checked tree, so that they reach into subtrees' files too and keep their places. A node is found
again by its number in the walk, for one file gives one shape whatever the mission's parameters are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from glotouch_bt.mission.findings import Finding, Findings
from glotouch_bt.mission.flow import check_flow
from glotouch_bt.mission.nodes import (
    KINDS,
    ConditionSettings,
    ForEachSettings,
    NodeSpec,
    ParallelSettings,
    Plain,
    RepeatSettings,
    RetrySettings,
    Settings,
    TimeoutSettings,
    Wire,
)
from glotouch_bt.mission.source import Place

Change = Callable[[NodeSpec], NodeSpec]
Slip = tuple[str, Place, str, Change]
TURNS = ("invert", "succeed", "fail")
"""Nodes that change a result."""


@dataclass(frozen=True)
class Mutant:
    """One slip.

    Attributes:
        operator: Its class: composite, drop, unwrap, wrap, order, bound, key, on_failure, constant, parameter.
        place: Where it was made.
        what: What was done, for a person.
        number: Number of the changed node in the walk of the tree.
        change: The node to what it becomes.
    """

    operator: str
    place: Place
    what: str
    number: int
    change: Change

    def apply(self, root: NodeSpec) -> NodeSpec:
        """The tree with this slip in it."""
        return _replaced(root, self.number, self.change)


def findings_of(root: NodeSpec) -> list[Finding]:
    """What `glotouch check` says of a tree."""
    findings = Findings()
    check_flow(root, findings)
    return findings.sorted()


def mutants_of(root: NodeSpec) -> Iterator[Mutant]:
    """Every mutant of a tree that differs from it and from those before."""
    seen = {signature(root)}
    parents = {id(child): node for node in root.walk() for child in node.children}
    keys = _keys_by_type(root)
    for number, node in enumerate(root.walk()):
        for operator, place, what, change in _changes(node, parents.get(id(node)), keys):
            mutant = Mutant(operator, place, what, number, change)
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


def _replaced(node: NodeSpec, number: int, change: Change) -> NodeSpec:
    """The node with the `number`-th one of its walk changed."""
    if number == 0:
        return change(node)
    children, at = list(node.children), 1
    for i, child in enumerate(children):
        size = sum(1 for _ in child.walk())
        if at <= number < at + size:
            children[i] = _replaced(child, number - at, change)
            break
        at += size
    return replace(node, children=tuple(children))


def _changes(node: NodeSpec, parent: NodeSpec | None, keys: Mapping[Any, list[str]]) -> Iterator[Slip]:
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


def _rewired(node: NodeSpec, keys: Mapping[Any, list[str]]) -> Iterator[Slip]:
    """Each wire the mission writes out, put to the next key of its type; a written one to a key nobody reads."""
    for side in ("reads", "writes"):
        for port, wire in getattr(node, side).items():
            if wire.place == node.place or port in node.constants:
                continue
            kind = next((k for k, names in keys.items() if wire.key in names), None)
            others = [k for k in keys.get(kind, []) if k != wire.key]
            new = others[0] if others else f"{wire.key}_elsewhere"
            words = f"{node.name!r}: {port} {wire.key!r} becomes {new!r}"
            yield "key", wire.place, words, _with_wire(side, port, replace(wire, key=new))


def _with_wire(side: str, port: str, wire: Wire) -> Change:
    if side == "reads":
        return lambda n: replace(n, reads={**n.reads, port: wire})
    return lambda n: replace(n, writes={**n.writes, port: wire})


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
