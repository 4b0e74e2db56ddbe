"""The variables of a tree: its keys with the kinds of values they may hold, and its resources with their states."""

from __future__ import annotations

from glotouch_bt.mission.nodes import StateVariables, ValueKind, kind_of
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.skill import UNCHANGED

FIRST_STATES = {"wrist": "untared"}
"""State of a resource when a mission begins; `empty` if it is not named here."""


def variables_of(tree: NodeSpec) -> StateVariables:
    """Return the variables of a tree."""
    return StateVariables(_kinds(tree), _states(tree))


def _states(tree: NodeSpec) -> dict[str, list[str]]:
    """Return every state of every resource that some skill of the tree names, the first state first."""
    states: dict[str, dict[str, None]] = {}

    def named(resource: str) -> dict[str, None]:
        return states.setdefault(resource, {FIRST_STATES.get(resource, "empty"): None})

    for node in tree.walk():
        skill = node.skill_type
        if skill is None:
            continue
        for table in (skill.PRECONDITIONS, skill.FAILURE_STATES):
            for resource, some in table.items():
                named(resource).update(dict.fromkeys(sorted(some - {UNCHANGED})))
        for resource, one in skill.POSTCONDITIONS.items():
            named(resource)[one] = None
    return {resource: list(names) for resource, names in states.items()}


def _kinds(tree: NodeSpec) -> dict[str, dict[ValueKind, None]]:
    """Return every kind of value that each key may hold over the whole tree, keys in the order of the nodes."""
    kinds: dict[str, dict[ValueKind, None]] = {}
    nodes = list(tree.walk())
    for node in nodes:
        for wire in (*node.reads.values(), *node.writes.values()):
            kinds.setdefault(wire.key, {})
        for port, wire in node.writes.items() if node.skill_type is not None else ():
            kinds[wire.key].update(dict.fromkeys(kind_of(node).written_kinds(node, port, lambda key: [*kinds[key]])))
    growing = True
    while growing:  # the kinds of one loop's items may come from what another loop gathers
        growing = False
        for node in nodes:
            for key, kind in kind_of(node).derived_kinds(node, lambda key: [*kinds[key]]):
                if kind not in kinds[key]:
                    kinds[key][kind] = None
                    growing = True
    return kinds
