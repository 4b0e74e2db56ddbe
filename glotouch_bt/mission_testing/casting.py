"""Assign outcomes to leaves: match a script's patterns against a mission's leaves and check them."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any, TypeAlias

from py_trees.ports_utils import is_instance_of_type

from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.mission_testing.leaf import Part, promised
from glotouch_bt.mission_testing.outcomes import Decide, LeafOutcome, Script, flat, ok
from glotouch_bt.robot import BadInput
from glotouch_bt.skill import Skill

Row: TypeAlias = "tuple[LeafOutcome | Decide, ...]"


class ScriptError(BadInput):
    """A script names something that the mission or its skills do not have. The mistake is in the test."""


def leaves_of(root: NodeSpec, title: str) -> dict[str, NodeSpec]:
    """Return the skill leaves by path."""
    return {p: n for p, n in root.paths(title).items() if n.skill_type is not None}


def fitting(pattern: str, leaves: Mapping[str, NodeSpec]) -> dict[str, NodeSpec]:
    """Return the leaves, by path, that a pattern matches.

    The exact name of a node matches that node alone. Otherwise the pattern is matched against node names, skill
    names and paths with the wildcards `*`, `?` and `[...]`: `squeeze*` matches `squeeze`, `squeeze 2` and so on.
    """
    named = {path: node for path, node in leaves.items() if node.name == pattern}
    if named:
        return named
    return {
        path: node
        for path, node in leaves.items()
        if any(fnmatchcase(name, pattern) for name in (node.name, node.skill, path))
    }


def cast(root: NodeSpec, title: str, script: Script) -> dict[str, Part | None]:
    """Return the part of each leaf by path; None: the real skill runs. Leaves without a pattern succeed.

    Patterns as in `fitting`. An exact node name wins; of several matching patterns the last one wins.

    Raises:
        ScriptError: A pattern matches no leaf, or the skill cannot have the outcome.
    """
    leaves = leaves_of(root, title)
    rows = {pattern: flat(answer) for pattern, answer in script.items()}
    meant: dict[str, str] = {}
    for pattern in sorted(rows, key=lambda p: any(p == node.name for node in leaves.values())):
        found = fitting(pattern, leaves)
        if not found:
            raise ScriptError(f"script: no leaf of {title!r} is called {pattern!r}{_near(pattern, leaves.values())}")
        meant |= dict.fromkeys(found, pattern)
    parts: dict[str, Part | None] = {}
    for path, node in leaves.items():
        chosen = meant.get(path)
        row: Row = (ok(),) if chosen is None else rows[chosen]
        if any(isinstance(o, LeafOutcome) and o.kind == "real" for o in row):
            if len(row) > 1:
                raise ScriptError(f"script: {chosen!r}: real() cannot stand in a row with other outcomes")
            parts[path] = None
            continue
        parts[path] = Part(path, node.skill, tuple(checked(o, node) for o in row))
    return parts


def checked(outcome: LeafOutcome | Decide, node: NodeSpec) -> LeafOutcome | Decide:
    """Return the outcome, checked against a node; a function's answer is checked when it is called.

    Raises:
        ScriptError: The skill does not give that code, has no such port, or the value is not of the port's type.
    """
    if not isinstance(outcome, LeafOutcome):
        return lambda call: _outcome(outcome(call), node)
    return _outcome(outcome, node)


def _outcome(outcome: LeafOutcome, node: NodeSpec) -> LeafOutcome:
    skill = node.skill_type
    assert skill is not None
    if not isinstance(outcome, LeafOutcome) or outcome.kind == "real":
        raise ScriptError(f"script: {node.name!r}: a function must decide on ok(), fails(), hangs() or raises()")
    codes = skill.failures(general=True)
    # A skill that declares nothing promises nothing.
    if outcome.kind == "fails" and outcome.code and skill.failures() and outcome.code not in codes:
        hint, known = _hint(outcome.code, codes), ", ".join(codes)
        raise ScriptError(f"script: {node.skill!r} never fails with {outcome.code!r}{hint} (it declares: {known})")
    return replace(outcome, ports=_ports(outcome, node.name, node.skill, skill))


def _ports(outcome: LeafOutcome, name: str, skill_name: str, skill: type[Skill]) -> dict[str, object]:
    ports: dict[str, object] = {}
    for port, value in outcome.ports.items():
        if port not in skill.OUTPUT_PORTS:
            known = ", ".join(skill.OUTPUT_PORTS) or "none"
            hint = _hint(port, skill.OUTPUT_PORTS)
            raise ScriptError(f"script: {name!r} ({skill_name}) has no output port {port!r}{hint} (it has: {known})")
        kind: Any = skill.OUTPUT_PORTS[port].data_type
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if value is None or not is_instance_of_type(value, kind):
            shown = getattr(kind, "__name__", str(kind))
            raise ScriptError(f"script: {name!r}: port {port!r} takes a {shown}, not {value!r}")
        always = promised(skill, port, outcome.kind) if outcome.kind in ("ok", "fails") else None
        if always is not None and value != always:
            raise ScriptError(f"script: {name!r}: {skill_name!r} promises {port} = {always!r} when it ends so")
        ports[port] = value
    return ports


def _hint(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _near(pattern: str, leaves: Iterable[NodeSpec]) -> str:
    names = list(dict.fromkeys(n for leaf in leaves for n in (leaf.name, leaf.skill)))
    return f"{_hint(pattern, names)} (leaves: {', '.join(names)})"
