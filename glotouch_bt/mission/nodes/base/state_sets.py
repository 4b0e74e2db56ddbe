"""Sets of states (a state gives a value to each of some variables), without listing them.

A set is a zero-suppressed multi-valued decision diagram (Minato, Zero-suppressed BDDs for set manipulation in
combinatorial problems, DAC 1993). A node of it tests one variable and has a child for each of its values; equal nodes
are one node; a variable that is 0 in all states of a set is not tested. So two sets are equal exactly if their numbers
are equal, independent variables cost their sum, not their product, and a variable that is still 0 costs nothing. The
recursion is as deep as there are variables. It goes through list comprehensions only, which stay off the C stack, so
that the interpreter's recursion limit may be raised for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

EMPTY = 0
"""The empty set of states."""
START = 1
"""The set of the one state in which all variables are 0."""


class StateSets:
    """The algebra of sets of states over some variables. A set is an int: `EMPTY`, `START`, or another.

    Args:
        sizes: Number of values of each variable. Later variables are tested first: those written late in a mission are
            then near the top, where they cost least.
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self._sizes = tuple(sizes)
        self._nodes: list[tuple[int, tuple[int, ...]]] = [(-1, ()), (-1, ())]
        self._ids: dict[tuple[int, tuple[int, ...]], int] = {}
        self._unions: dict[tuple[int, int], int] = {}
        self._meets: dict[tuple[int, int], int] = {}
        self._done: dict[tuple[int, int, int, int], int] = {}

    def _node(self, variable: int, children: tuple[int, ...]) -> int:
        if not any(children[1:]):
            return children[0]
        made = (variable, children)
        found = self._ids.get(made)
        if found is None:
            found = self._ids[made] = len(self._nodes)
            self._nodes.append(made)
        return found

    def _children(self, node: int, variable: int) -> tuple[int, ...]:
        """Return a node's children by the values of a variable that it tests first, or that is 0 in it."""
        at, children = self._nodes[node]
        return children if at == variable else (node,) + (EMPTY,) * (self._sizes[variable] - 1)

    def union(self, *sets: int) -> int:
        """Return the union."""
        made = EMPTY
        for one in sets:
            made = self._union(made, one)
        return made

    def _union(self, a: int, b: int) -> int:
        if EMPTY in (a, b) or a == b:
            return a or b
        key = (a, b) if a < b else (b, a)
        found = self._unions.get(key)
        if found is None:
            variable = max(self._nodes[a][0], self._nodes[b][0])
            pairs = zip(self._children(a, variable), self._children(b, variable), strict=True)
            found = self._unions[key] = self._node(variable, tuple([self._union(x, y) for x, y in pairs]))
        return found

    def meet(self, a: int, b: int) -> int:
        """Return the intersection of two sets."""
        if EMPTY in (a, b):
            return EMPTY
        if a == b:
            return a
        key = (a, b) if a < b else (b, a)
        found = self._meets.get(key)
        if found is None:
            variable = max(self._nodes[a][0], self._nodes[b][0])
            pairs = zip(self._children(a, variable), self._children(b, variable), strict=True)
            found = self._meets[key] = self._node(variable, tuple([self.meet(x, y) for x, y in pairs]))
        return found

    def where(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Return the states in which a variable has one of some values."""
        bits = 0
        for value in values:
            bits |= 1 << value
        return self._apply(given, variable, bits, 0)

    def assign(self, given: int, variable: int, value: int) -> int:
        """Return all states, with a variable set to a value."""
        return self._apply(given, variable, 1 << value, 1)

    def allow(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Return all states as they are, and with a variable set to any of some values."""
        return self.union(given, *(self.assign(given, variable, v) for v in values))

    def _apply(self, given: int, variable: int, bits: int, forget: int) -> int:
        """Restrict a variable to the values in `bits`; with `forget`, whatever value it had."""
        at = self._nodes[given][0]
        if given == EMPTY:
            return EMPTY
        if at < variable:  # it is 0
            if not forget:
                return given if bits & 1 else EMPTY
            return self._node(
                variable, tuple([given if bits >> v & 1 else EMPTY for v in range(self._sizes[variable])])
            )
        key = (given, variable, bits, forget)
        found = self._done.get(key)
        if found is None:
            children = self._nodes[given][1]
            if at > variable:
                made = tuple([self._apply(c, variable, bits, forget) for c in children])
            else:
                if forget:
                    children = (self.union(*children),) * len(children)
                made = tuple([c if bits >> v & 1 else EMPTY for v, c in enumerate(children)])
            found = self._done[key] = self._node(at, made)
        return found

    def values(self, given: int, variable: int) -> frozenset[int]:
        """Return the values that a variable has in some state of a set."""
        found: set[int] = set()
        seen: set[int] = set()
        todo = [given] if given else []
        while todo:
            node = todo.pop()
            if node in seen:
                continue
            seen.add(node)
            at, children = self._nodes[node]
            if at > variable:
                todo += [c for c in children if c]
            elif at == variable:
                found.update(v for v, c in enumerate(children) if c)
            else:
                found.add(0)
        return frozenset(found)
