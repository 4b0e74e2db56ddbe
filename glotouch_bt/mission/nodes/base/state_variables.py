"""The variables that make up a mission's state: one for each key, one for each resource, and their possible values.

A key is unset, or holds a value of some kind: its type, the type of its items, its unit. A resource is in one of the
states that skills name. One more variable is 1 after an unknown node: of what follows nothing is claimed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

UNSET, ANYTHING = 0, 1
"""Values of every key's variable: not written, and written with a value of an unknown kind."""


@dataclass(frozen=True)
class ValueKind:
    """Static knowledge about one value.

    Attributes:
        data_type: Its type; `object` when not known.
        element: Type of a tuple's items; `object` when not known.
        unit: Unit its port's name carries, or empty.
        value: The value itself, where the writer's outcome fixes it; None: any.
    """

    data_type: type = object
    element: type = object
    unit: str = ""
    value: bool | int | float | str | None = None

    @property
    def item(self) -> ValueKind:
        """The kind of a tuple's items."""
        return ValueKind(self.element)

    @staticmethod
    def tuple_of(kinds: Iterable[ValueKind]) -> ValueKind:
        """Return the kind of a tuple of values of these kinds."""
        types = {k.data_type for k in kinds}
        return ValueKind(tuple, types.pop() if len(types) == 1 else object)


class StateVariables:
    """The variables of a tree.

    Args:
        kinds: Every kind of value that each key may hold.
        states: Every state of each resource, the first state first.

    Attributes:
        sizes: Number of values of each variable.
        keys: Variable of each key.
        resources: Variable of each resource.
        lost: Variable that is 1 once an unknown node may have run.
    """

    def __init__(self, kinds: Mapping[str, Iterable[ValueKind]], states: Mapping[str, list[str]]) -> None:
        unknown = ValueKind()
        self._kinds = {key: [unknown, unknown, *found] for key, found in kinds.items()}  # 0 and 1 stand for no kind
        self._states = states
        self.keys = {key: i for i, key in enumerate(kinds)}
        self.resources = {name: len(self.keys) + i for i, name in enumerate(self._states)}
        self.lost = len(self.keys) + len(self.resources)
        self.sizes = (*(len(k) for k in self._kinds.values()), *(len(s) for s in self._states.values()), 2)

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
        """Return what these values stand for, ANYTHING first."""
        return self._kinds[key][ANYTHING:]

    def state(self, resource: str, name: str) -> int:
        """Return the value of a resource's variable that stands for a state."""
        return self._states[resource].index(name)

    def state_names(self, resource: str) -> list[str]:
        """Return all states of a resource."""
        return self._states[resource]
