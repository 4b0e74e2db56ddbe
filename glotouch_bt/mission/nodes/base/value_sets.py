"""Sets of values of each variable on its own: a fast, larger stand-in for sets of states.

A set says which values each variable may have, and nothing about which of them occur together. It contains every state
of the exact set (`state_sets`), and more. It is one integer, with a bit for each value of each variable.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import accumulate

from glotouch_bt.mission.nodes.base.state_sets import EMPTY, merged_changes


class ValueSets:
    """The algebra of `StateSets`, each variable on its own.

    Args:
        sizes: Number of values of each variable.

    Attributes:
        start: The set of the one state in which all variables are 0.
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self._sizes = tuple(sizes)
        self._first = [0, *accumulate(self._sizes)]  # bit of each variable's value 0
        self._all = [(1 << size) - 1 << bit for size, bit in zip(self._sizes, self._first, strict=False)]
        self._changes: list[list[tuple[int, int, bool]]] = []
        self.start = sum(1 << bit for bit in self._first[:-1])

    def union(self, *sets: int) -> int:
        """Return a set that contains the union."""
        made = EMPTY
        for one in sets:
            made |= one
        return made

    def meet(self, a: int, b: int) -> int:
        """Return a set that contains the intersection."""
        made = a & b
        return made if all(made & whole for whole in self._all) else EMPTY

    def where(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Return a set that contains the states in which a variable has one of some values."""
        kept = given & self._bits(variable, values)
        return given & ~self._all[variable] | kept if kept else EMPTY

    def assign(self, given: int, variable: int, value: int) -> int:
        """Return all states, with a variable set to a value."""
        return given & ~self._all[variable] | self._bits(variable, (value,)) if given else EMPTY

    def allow(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Return a set that contains all states as they are, and with a variable set to any of some values."""
        return given | self._bits(variable, values) if given else EMPTY

    def changes(self, wanted: Iterable[tuple[int, Iterable[int], bool]]) -> int:
        """Return the number of some changes, for `write`; see `StateSets`."""
        merged = merged_changes(wanted).items()
        self._changes.append([(self._all[v], bits << self._first[v], keep) for v, (bits, keep) in merged])
        return len(self._changes) - 1

    def write(self, given: int, changes: int) -> int:
        """Return a set that contains all states after changes of some variables."""
        for whole, bits, keep in self._changes[changes] if given else ():
            given = given | bits if keep else given & ~whole | bits
            if not given & whole:
                return EMPTY
        return given

    def follows(self, variable: int) -> bool:
        """Return True: all variables are followed."""
        return True

    def values(self, given: int, variable: int) -> frozenset[int]:
        """Return the values that a variable may have in a set."""
        return frozenset(v for v in range(self._sizes[variable]) if given >> self._first[variable] + v & 1)

    def _bits(self, variable: int, values: Iterable[int]) -> int:
        made = 0
        for value in values:
            made |= 1 << self._first[variable] + value
        return made
