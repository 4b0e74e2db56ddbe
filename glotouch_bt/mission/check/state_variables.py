"""What a configuration of a mission is made of: one variable for each key and each resource, and what they can be.

A key is unset, or holds a value of some kind: what type, of what items, in what unit. A resource is in one of the
states that skills name. One more variable says that a node nobody knows has run: of what follows nothing is claimed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from glotouch_bt.mission.check.state_sets import START, Configurations
from glotouch_bt.mission.spec import NodeSpec, unit_of_name
from glotouch_bt.skill import UNCHANGED

UNSET, ANYTHING = 0, 1
FIRST_STATE = "empty"
"""The state of every resource when a mission begins."""


@dataclass(frozen=True)
class Kind:
    """What is known of a value.

    Attributes:
        data_type: Its type; `object` when not known.
        element: Type of a tuple's items; `object` when not known.
        unit: Unit its port's name carries, or empty.
        value: The value itself, where the writer's outcome says it; None: any.
    """

    data_type: type = object
    element: type = object
    unit: str = ""
    value: bool | int | float | str | None = None


UNKNOWN = Kind()


def written_kind(node: NodeSpec, port: str, how: str) -> Kind:
    """The kind of what a skill writes to a port; `how` it ends: success, failure or running (broken off)."""
    assert node.skill_type is not None
    declared = getattr(node.skill_type, port, None)
    element = getattr(declared, "element", None) or object
    value = getattr(declared, f"on_{how}", None)
    return Kind(node.skill_type.OUTPUT_PORTS[port].data_type, element, unit_of_name(port), value)


def written_kinds(node: NodeSpec, port: str) -> list[Kind]:
    """All kinds of what a skill may write to a port, each once."""
    return list(dict.fromkeys(written_kind(node, port, how) for how in ("success", "failure", "running")))


class Variables:
    """The variables of a tree and the sets over them.

    Attributes:
        sets: The algebra.
        start: The set of the one configuration in which a mission begins: no key written.
        keys: Variable of each key.
        resources: Variable of each resource.
        lost: Variable that is 1 once a node nobody knows may have run.
    """

    def __init__(self, tree: NodeSpec) -> None:
        kinds = _kinds(tree)
        self._kinds = {key: [UNKNOWN, UNKNOWN, *found] for key, found in kinds.items()}  # places 0 and 1 are never met
        self._states = _states(tree)
        self.keys = {key: i for i, key in enumerate(kinds)}
        self.resources = {name: len(self.keys) + i for i, name in enumerate(self._states)}
        self.lost = len(self.keys) + len(self.resources)
        self.names = (*self.keys, *self.resources)
        sizes = [*(len(k) for k in self._kinds.values()), *(len(s) for s in self._states.values()), 2]
        self.sets = Configurations(sizes)
        self.start = START

    def kind(self, key: str, value: int) -> Kind:
        """What a value of a key's variable stands for."""
        return self._kinds[key][value]

    def value(self, key: str, kind: Kind) -> int:
        """The value of a key's variable that stands for a kind."""
        found = self._kinds[key]
        return found.index(kind, ANYTHING + 1) if kind in found[ANYTHING + 1 :] else ANYTHING

    def written(self, key: str) -> range:
        """All values of a key's variable but unset."""
        return range(ANYTHING, len(self._kinds[key]))

    def state(self, resource: str, name: str) -> int:
        """The value of a resource's variable that stands for a state."""
        return self._states[resource].index(name)

    def state_names(self, resource: str) -> list[str]:
        """All states of a resource."""
        return self._states[resource]


def _states(tree: NodeSpec) -> dict[str, list[str]]:
    """Every state of every resource that some skill of the tree names, the first one first."""
    states: dict[str, dict[str, None]] = {}
    for node in tree.walk():
        skill = node.skill_type
        if skill is None:
            continue
        for table in (skill.PRECONDITIONS, skill.FAILURE_STATES):
            for resource, named in table.items():
                states.setdefault(resource, {FIRST_STATE: None}).update(dict.fromkeys(sorted(named - {UNCHANGED})))
        for resource, one in skill.POSTCONDITIONS.items():
            states.setdefault(resource, {FIRST_STATE: None})[one] = None
    return {resource: list(named) for resource, named in states.items()}


def _kinds(tree: NodeSpec) -> dict[str, dict[Kind, None]]:
    """Every kind of value that each key may hold, over the whole tree, keys in the order in which they are met."""
    kinds: dict[str, dict[Kind, None]] = {}
    loops: list[NodeSpec] = []
    for node in tree.walk():
        for wire in (*node.reads.values(), *node.writes.values()):
            kinds.setdefault(wire.key, {})
        if node.skill_type is not None:
            for port, wire in node.writes.items():
                kinds[wire.key].update(dict.fromkeys(written_kinds(node, port)))
        elif node.kind == "for_each" and "items" in node.reads and "item" in node.writes:
            loops.append(node)
    growing = True
    while growing:  # kinds of items may come from what another loop gathers
        growing = False
        for node in loops:
            for key, kind in loop_writes(node, kinds):
                if kind not in kinds[key]:
                    kinds[key][kind] = None
                    growing = True
    return kinds


def loop_writes(node: NodeSpec, kinds: Mapping[str, Mapping[Kind, None]]) -> list[tuple[str, Kind]]:
    """What a for_each may write, given what keys may hold: its item, and the tuples it gathers."""
    found = [(node.writes["item"].key, item_kind(k)) for k in kinds[node.reads["items"].key]]
    for port, target in node.writes.items():
        source = node.reads.get(port)
        if source is not None:
            found.append((target.key, gathered_kind(kinds[source.key])))
            found += [(target.key, gathered_kind({k: None})) for k in kinds[source.key]]
    return found


def item_kind(items: Kind) -> Kind:
    """The kind of the items of a tuple."""
    return Kind(items.element)


def gathered_kind(kinds: Mapping[Kind, None]) -> Kind:
    """The kind of a tuple of values of these kinds."""
    types = {k.data_type for k in kinds}
    return Kind(tuple, types.pop() if len(types) == 1 else object)
