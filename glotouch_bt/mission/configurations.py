"""Sets of configurations (an assignment of a value to each of some variables), without listing them.

A set is a multi-valued decision diagram (Srinivasan et al., Algorithms for discrete function manipulation, ICCAD 1990):
a node asks for one variable and has a child for each of its values; nodes with the same children are one node, and a
node whose children are all the same is left out. So two sets are equal exactly if they are the same number, and
independent variables cost their sum, not their product. Recursion is as deep as there are variables, through list
comprehensions only: those stay off the C stack, so that the interpreter's recursion limit may be raised for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

EMPTY, FULL = 0, 1


class Configurations:
    """The algebra of sets over some variables. A set is an int; `EMPTY` and `FULL` are two of them.

    Args:
        sizes: How many values each variable has, in the order in which they are asked for.
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self._sizes = tuple(sizes)
        last = len(self._sizes)
        self._nodes: list[tuple[int, tuple[int, ...]]] = [(last, ()), (last, ())]
        self._ids: dict[tuple[int, tuple[int, ...]], int] = {}
        self._unions: dict[tuple[int, int], int] = {}
        self._meets: dict[tuple[int, int], int] = {}
        self._done: dict[tuple[int, int, int, int], int] = {}

    def _node(self, variable: int, children: tuple[int, ...]) -> int:
        first = children[0]
        if all(c == first for c in children):
            return first
        made = (variable, children)
        found = self._ids.get(made)
        if found is None:
            found = self._ids[made] = len(self._nodes)
            self._nodes.append(made)
        return found

    def _children(self, node: int, variable: int) -> tuple[int, ...]:
        """A node's children by the values of a variable that it asks for first, or does not ask for."""
        at, children = self._nodes[node]
        return children if at == variable else (node,) * self._sizes[variable]

    def union(self, *sets: int) -> int:
        """What is in any of them."""
        made = EMPTY
        for one in sets:
            made = self._union(made, one)
        return made

    def _union(self, a: int, b: int) -> int:
        if a in (b, FULL) or b == EMPTY:
            return a
        if a == EMPTY or b == FULL:
            return b
        key = (a, b) if a < b else (b, a)
        found = self._unions.get(key)
        if found is None:
            variable = min(self._nodes[a][0], self._nodes[b][0])
            pairs = zip(self._children(a, variable), self._children(b, variable), strict=True)
            found = self._unions[key] = self._node(variable, tuple([self._union(x, y) for x, y in pairs]))
        return found

    def meet(self, a: int, b: int) -> int:
        """What is in both."""
        if a in (b, EMPTY) or b == FULL:
            return a
        if b == EMPTY or a == FULL:
            return b
        key = (a, b) if a < b else (b, a)
        found = self._meets.get(key)
        if found is None:
            variable = min(self._nodes[a][0], self._nodes[b][0])
            pairs = zip(self._children(a, variable), self._children(b, variable), strict=True)
            found = self._meets[key] = self._node(variable, tuple([self.meet(x, y) for x, y in pairs]))
        return found

    def where(self, given: int, variable: int, values: Iterable[int]) -> int:
        """Those in which a variable has one of some values."""
        bits = 0
        for value in values:
            bits |= 1 << value
        return self._apply(given, variable, bits, 0)

    def assign(self, given: int, variable: int, value: int) -> int:
        """All of them, with a variable set to a value."""
        return self._apply(given, variable, 1 << value, 1)

    def allow(self, given: int, variable: int, values: Iterable[int]) -> int:
        """All of them, and all of them with a variable set to any of some values."""
        return self.union(given, *(self.assign(given, variable, v) for v in values))

    def _apply(self, given: int, variable: int, bits: int, forget: int) -> int:
        """Restrict a variable to the values in `bits`, after forgetting what it was if `forget`."""
        at = self._nodes[given][0]
        if given == EMPTY:
            return EMPTY
        if at > variable:  # not asked for: any value is possible
            size = self._sizes[variable]
            return self._node(variable, tuple(given if bits >> v & 1 else EMPTY for v in range(size)))
        key = (given, variable, bits, forget)
        found = self._done.get(key)
        if found is None:
            children = self._nodes[given][1]
            if at < variable:
                made = tuple([self._apply(c, variable, bits, forget) for c in children])
            else:
                if forget:
                    children = (self.union(*children),) * len(children)
                made = tuple(c if bits >> v & 1 else EMPTY for v, c in enumerate(children))
            found = self._done[key] = self._node(at, made)
        return found

    def values(self, given: int, variable: int) -> frozenset[int]:
        """The values a variable has in some of them."""
        return frozenset(v for v in range(self._sizes[variable]) if self.where(given, variable, (v,)) != EMPTY)

    def only(self, values: Mapping[int, int]) -> int:
        """The set in which these variables have these values and the others any."""
        made = FULL
        for variable, value in values.items():
            made = self.where(made, variable, (value,))
        return made

    def holds(self, given: int, configuration: Sequence[int]) -> bool:
        """A configuration (a value for each variable) is in the set."""
        while given > FULL:
            variable, children = self._nodes[given]
            given = children[configuration[variable]]
        return given == FULL
