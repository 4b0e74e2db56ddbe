"""Sets of states (a state gives a value to each of some variables), without listing them.

A set is a zero-suppressed multi-valued decision diagram (Minato, Zero-suppressed BDDs for set manipulation in
combinatorial problems, DAC 1993). A node of it tests one variable and has a child for each of its values; equal nodes
are one node; a variable that is 0 in all states of a set is not tested. So two sets are equal exactly if their numbers
are equal, independent variables cost their sum, not their product, and a variable that is still 0 costs nothing. Each
node also has the values that occur in its states, so a condition that all states meet, or none, is not looked for.

The recursion is as deep as there are variables. It goes through plain calls and list comprehensions only, which stay
off the C stack, so that the interpreter's recursion limit may be raised for it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import accumulate

EMPTY = 0
"""The empty set of states."""


class StateSets:
    """The algebra of sets of states over some variables. A set is an int: `EMPTY`, `start`, or another.

    Args:
        sizes: Number of values of each variable. Later variables are tested first: those written late in a mission are
            then near the top, where they cost least.
        followed: Variables that are followed; None: all. The value of any other variable is ignored: a set then stands
            for its projection onto the followed variables.

    Attributes:
        start: The set of the one state in which all variables are 0.
    """

    start = 1

    def __init__(self, sizes: Sequence[int], followed: Collection[int] | None = None) -> None:
        self._sizes = tuple(sizes)
        self._ignored = frozenset() if followed is None else frozenset(range(len(self._sizes))) - frozenset(followed)
        self._first = [0, *accumulate(self._sizes)]  # bit of each variable's value 0 in `_held`
        self._nodes: list[tuple[int, tuple[int, ...]]] = [(-1, ()), (-1, ())]
        self._held = [0, sum(1 << bit for bit in self._first[:-1])]  # each node's values of all variables, as bits
        self._ids: dict[tuple[int, tuple[int, ...]], int] = {}
        self._unions: dict[tuple[int, int], int] = {}
        self._meets: dict[tuple[int, int], int] = {}
        self._parts: dict[tuple[int, int, int], int] = {}
        self._changes: list[tuple[int, int, bool, int]] = [(-1, 0, False, 0)]
        self._change_ids: dict[tuple[int, int, bool, int], int] = {}
        self._written: dict[tuple[int, int], int] = {}

    def _node(self, variable: int, children: tuple[int, ...]) -> int:
        if not any(children[1:]):
            return children[0]
        made = (variable, children)
        found = self._ids.get(made)
        if found is None:
            found = self._ids[made] = len(self._nodes)
            self._nodes.append(made)
            zero = 1 << self._first[variable]
            held = self._held[children[0]]
            for value, child in enumerate(children):
                if value and child:
                    held |= self._held[child] ^ zero | zero << value
            self._held.append(held)
        return found

    def union(self, *sets: int) -> int:
        """Return the union."""
        made = EMPTY
        for one in sets:
            made = self._union(made, one)
        return made

    def _union(self, a: int, b: int) -> int:
        if a == b or b == EMPTY:
            return a
        if a == EMPTY:
            return b
        key = (a, b) if a < b else (b, a)
        found = self._unions.get(key)
        if found is None:
            (at, these), (other, those) = self._nodes[a], self._nodes[b]
            if at == other:
                made = self._node(at, tuple([self._union(x, y) for x, y in zip(these, those, strict=True)]))
            elif at > other:
                made = self._node(at, (self._union(these[0], b), *these[1:]))
            else:
                made = self._node(other, (self._union(a, those[0]), *those[1:]))
            found = self._unions[key] = made
        return found

    def meet(self, a: int, b: int) -> int:
        """Return the intersection of two sets."""
        if a == b or EMPTY in (a, b):
            return a and b
        key = (a, b) if a < b else (b, a)
        found = self._meets.get(key)
        if found is None:
            (at, these), (other, those) = self._nodes[a], self._nodes[b]
            if at == other:
                made = self._node(at, tuple([self.meet(x, y) for x, y in zip(these, those, strict=True)]))
            else:
                made = self.meet(these[0], b) if at > other else self.meet(a, those[0])
            found = self._meets[key] = made
        return found

    def where(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Return the states in which a variable has one of some values."""
        return given if variable in self._ignored else self._where(given, variable, _bits(values))

    def _where(self, given: int, variable: int, bits: int) -> int:
        held = self._values(given, variable)
        if not held & bits:
            return EMPTY
        if held & bits == held:
            return given
        key = (given, variable, bits)
        found = self._parts.get(key)
        if found is None:
            at, children = self._nodes[given]
            if at > variable:
                made = [self._where(c, variable, bits) for c in children]
            else:
                made = [c if bits >> v & 1 else EMPTY for v, c in enumerate(children)]
            found = self._parts[key] = self._node(at, tuple(made))
        return found

    def assign(self, given: int, variable: int, value: int) -> int:
        """Return all states, with a variable set to a value."""
        return self.write(given, self.changes([(variable, (value,), False)]))

    def allow(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Return all states as they are, and with a variable set to any of some values."""
        return self.write(given, self.changes([(variable, values, True)]))

    def changes(self, wanted: Iterable[tuple[int, Iterable[int], bool]]) -> int:
        """Return the number of some changes, for `write`.

        Args:
            wanted: Variable, its possible values afterwards, and whether it may keep its value. What changes twice has
                one of the values of both.
        """
        merged = merged_changes(wanted)
        made = 0  # the changes of variables that are tested later; equal rests have one number
        for variable in sorted(merged):
            if variable not in self._ignored:
                change = (variable, *merged[variable], made)
                made = self._change_ids.setdefault(change, len(self._changes))
                if made == len(self._changes):
                    self._changes.append(change)
        return made

    def follows(self, variable: int) -> bool:
        """Return True if a variable is followed."""
        return variable not in self._ignored

    def write(self, given: int, changes: int) -> int:
        """Return all states after changes of some variables (`changes`)."""
        variable = bits = rest = 0
        keep = False
        while changes:
            variable, bits, keep, rest = self._changes[changes]
            held = self._values(given, variable)
            if held == 0:  # no state
                return EMPTY
            if held != bits or bits & bits - 1:
                break
            changes = rest  # all states have that value
        if not changes:
            return given
        key = (given, changes)
        found = self._written.get(key)
        if found is None:
            at, children = self._nodes[given]
            if at > variable:
                found = self._node(at, tuple([self.write(c, changes) for c in children]))
            else:
                if at < variable:  # it is 0
                    children = (given,) + (EMPTY,) * (self._sizes[variable] - 1)
                whole = self.write(self.union(*children), rest)
                kept = [self.write(c, rest) for c in children] if keep else (EMPTY,) * len(children)
                found = self._node(variable, tuple([whole if bits >> v & 1 else c for v, c in enumerate(kept)]))
            self._written[key] = found
        return found

    def values(self, given: int, variable: int) -> frozenset[int]:
        """Return the values that a variable has in some state of a set."""
        held = self._values(given, variable)
        return frozenset(v for v in range(self._sizes[variable]) if held >> v & 1)

    def _values(self, given: int, variable: int) -> int:
        """Return these values as bits."""
        return self._held[given] >> self._first[variable] & (1 << self._sizes[variable]) - 1


def merged_changes(wanted: Iterable[tuple[int, Iterable[int], bool]]) -> dict[int, tuple[int, bool]]:
    """Return, for each changed variable, its possible values as bits, and whether it may keep its value."""
    merged: dict[int, tuple[int, bool]] = {}
    for variable, values, keep in wanted:
        bits, both = merged.get(variable, (0, True))
        merged[variable] = (bits | _bits(values), both and keep)
    return merged


def _bits(values: Iterable[int]) -> int:
    """Return the numbers as bits."""
    bits = 0
    for value in values:
        bits |= 1 << value
    return bits
