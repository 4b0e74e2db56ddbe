"""Which node plays which outcomes: a script's patterns laid over a mission's leaves, and checked against them."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any, TypeAlias

from py_trees.ports_utils import is_instance_of_type

from glotouch_bt.mission.nodes import NodeSpec
from glotouch_bt.mission_testing.leaf import Part
from glotouch_bt.mission_testing.outcomes import Decide, Outcome, Script, flat, ok
from glotouch_bt.robot import BadInput
from skills.base import Skill

Row: TypeAlias = "tuple[Outcome | Decide, ...]"


class ScriptError(BadInput):
    """A script asks for what the mission or its skills do not have: a slip in the test, not in the mission."""


def paths_of(root: NodeSpec, title: str) -> dict[str, NodeSpec]:
    """Every node by its path, as the runner names it."""
    found: dict[str, NodeSpec] = {}

    def visit(node: NodeSpec, above: str) -> None:
        path = f"{above}/{node.name}"
        found[path] = node
        for child in node.children:
            visit(child, path)

    visit(root, title)
    return found


def leaves_of(root: NodeSpec, title: str) -> dict[str, NodeSpec]:
    """The skills by their path."""
    return {p: n for p, n in paths_of(root, title).items() if n.kind == "skill"}


def fits(pattern: str, path: str, node: NodeSpec) -> bool:
    """A pattern fits a node by its name, its skill's name or its path; `*`, `?` and `[...]` as in file names."""
    return any(fnmatchcase(name, pattern) for name in (node.name, node.skill, path))


def cast(root: NodeSpec, title: str, script: Script) -> dict[str, Part | None]:
    """The part of each leaf by its path; None: the skill plays itself. What no pattern fits succeeds.

    A name of a node wins over all patterns; of several patterns that fit, the last one wins.

    Raises:
        ScriptError: A pattern fits no leaf, or an outcome is none the skill can have.
    """
    leaves = leaves_of(root, title)
    rows = {pattern: flat(answer) for pattern, answer in script.items()}
    for pattern in rows:
        if not any(fits(pattern, path, node) for path, node in leaves.items()):
            raise ScriptError(f"script: no leaf of {title!r} is called {pattern!r}{_near(pattern, leaves.values())}")
    parts: dict[str, Part | None] = {}
    for path, node in leaves.items():
        fitting = [p for p in rows if fits(p, path, node)]
        chosen = node.name if node.name in rows else fitting[-1] if fitting else None
        row: Row = (ok(),) if chosen is None else rows[chosen]
        if any(isinstance(o, Outcome) and o.kind == "real" for o in row):
            if len(row) > 1:
                raise ScriptError(f"script: {chosen!r}: real() cannot stand in a row with other outcomes")
            parts[path] = None
            continue
        parts[path] = Part(path, node.skill, tuple(checked(o, node) for o in row))
    return parts


def checked(outcome: Outcome | Decide, node: NodeSpec) -> Outcome | Decide:
    """The outcome, made fit for a node; what a function decides is checked when it has decided.

    Raises:
        ScriptError: The skill does not give that code, has no such port, or the value is not of the port's type.
    """
    if not isinstance(outcome, Outcome):
        return lambda call: _outcome(outcome(call), node)
    return _outcome(outcome, node)


def _outcome(outcome: Outcome, node: NodeSpec) -> Outcome:
    skill = node.skill_type
    assert skill is not None
    if not isinstance(outcome, Outcome) or outcome.kind == "real":
        raise ScriptError(f"script: {node.name!r}: a function must decide on ok(), fails(), hangs() or raises()")
    codes = skill.failure_codes()
    # A skill that declares nothing promises nothing.
    if outcome.kind == "fails" and outcome.code and skill.FAILURES and outcome.code not in codes:
        hint, known = _hint(outcome.code, codes), ", ".join(codes)
        raise ScriptError(f"script: {node.skill!r} never fails with {outcome.code!r}{hint} (it declares: {known})")
    return replace(outcome, ports=_ports(outcome.ports, node.name, node.skill, skill))


def _ports(given: Mapping[str, object], name: str, skill_name: str, skill: type[Skill]) -> dict[str, object]:
    ports: dict[str, object] = {}
    for port, value in given.items():
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
        ports[port] = value
    return ports


def _hint(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def _near(pattern: str, leaves: Iterable[NodeSpec]) -> str:
    names = list(dict.fromkeys(n for leaf in leaves for n in (leaf.name, leaf.skill)))
    return f"{_hint(pattern, names)} (leaves: {', '.join(names)})"
