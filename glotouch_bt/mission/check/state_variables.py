"""The variables that make up a mission's state: one for each key, one for each resource, and their possible values.

A key is unset, or holds a value of some kind: its type, the type of its items, its unit. A resource is in one of the
states that skills name. One more variable is 1 after an unknown node: of what follows nothing is claimed.
"""

from __future__ import annotations

from glotouch_bt.mission.check.state_sets import START, StateSets
from glotouch_bt.mission.nodes import ANYTHING, ValueKind, kind_of
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.skill import UNCHANGED

FIRST_STATE = "empty"
"""The state of every resource when a mission begins."""
_UNKNOWN = ValueKind()


class StateVariables:
    """The variables of a tree and the sets over them.

    Attributes:
        sets: The algebra.
        start: The set of the one state in which a mission begins: no key written.
        keys: Variable of each key.
        resources: Variable of each resource.
        lost: Variable that is 1 once an unknown node may have run.
    """

    def __init__(self, tree: NodeSpec) -> None:
        kinds = _kinds(tree)
        self._kinds = {key: [_UNKNOWN, _UNKNOWN, *found] for key, found in kinds.items()}  # 0 and 1 stand for no kind
        self._states = _states(tree)
        self.keys = {key: i for i, key in enumerate(kinds)}
        self.resources = {name: len(self.keys) + i for i, name in enumerate(self._states)}
        self.lost = len(self.keys) + len(self.resources)
        sizes = [*(len(k) for k in self._kinds.values()), *(len(s) for s in self._states.values()), 2]
        self.sets = StateSets(sizes)
        self.start = START

    def kind(self, key: str, value: int) -> ValueKind:
        """Return what a value of a key's variable stands for."""
        return self._kinds[key][value]

    def value(self, key: str, kind: ValueKind) -> int:
        """Return the value of a key's variable that stands for a kind."""
        found = self._kinds[key]
        return found.index(kind, ANYTHING + 1) if kind in found[ANYTHING + 1 :] else ANYTHING

    def written(self, key: str) -> range:
        """Return all values of a key's variable but UNSET."""
        return range(ANYTHING, len(self._kinds[key]))

    def written_kinds(self, key: str) -> list[ValueKind]:
        """Return what these values stand for."""
        return self._kinds[key][ANYTHING:]

    def state(self, resource: str, name: str) -> int:
        """Return the value of a resource's variable that stands for a state."""
        return self._states[resource].index(name)

    def state_names(self, resource: str) -> list[str]:
        """Return all states of a resource."""
        return self._states[resource]


def _states(tree: NodeSpec) -> dict[str, list[str]]:
    """Return every state of every resource that some skill of the tree names, the first state first."""
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
