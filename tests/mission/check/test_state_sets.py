"""Sets of states against the sets of Python."""

from __future__ import annotations

from itertools import product

from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.mission.nodes.base import EMPTY, StateSets, ValueSets
from tests.support.examples import examples


def holds(algebra: StateSets, given: int, state: tuple[int, ...]) -> bool:
    for variable, value in enumerate(state):
        given = algebra.where(given, variable, (value,))
    return given != EMPTY


@settings(max_examples=examples(80, 200), deadline=None)
@given(
    sizes=st.lists(st.integers(2, 3), min_size=1, max_size=4),
    steps=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 3), st.integers(0, 7), st.integers(0, 9)), max_size=12),
)
def test_diagrams_are_sets(sizes: list[int], steps: list[tuple[int, int, int, int]]) -> None:
    """Every operation of `StateSets` against plain sets of tuples."""
    algebra = StateSets(sizes)
    kept: list[tuple[int, set[tuple[int, ...]]]] = [(EMPTY, set()), (algebra.start, {(0,) * len(sizes)})]
    for operation, variable, bits, which in steps:
        variable %= len(sizes)
        values = [v for v in range(sizes[variable]) if bits >> v & 1]
        (a, plain), (b, other) = kept[-1], kept[which % len(kept)]
        if operation == 0:
            made, want = algebra.union(a, b), plain | other
        elif operation == 1:
            made, want = algebra.meet(a, b), plain & other
        elif operation == 2:
            made, want = algebra.where(a, variable, values), {c for c in plain if c[variable] in values}
        elif operation == 5:
            also, keep = which % len(sizes), which > 4
            changes = [(variable, values, keep), *([(also, (0, 1), True)] if also != variable else [])]
            made = algebra.write(a, algebra.changes(changes))
            want = {(*c[:variable], v, *c[variable + 1 :]) for c in plain for v in values} | (plain if keep else set())
            if also != variable:
                want |= {(*c[:also], v, *c[also + 1 :]) for c in want for v in (0, 1)}
        else:
            want = {(*c[:variable], v, *c[variable + 1 :]) for c in plain for v in values}
            made = algebra.allow(a, variable, values)
            want |= plain
            if operation == 3 and values:
                made = algebra.assign(a, variable, values[0])
                want = {(*c[:variable], values[0], *c[variable + 1 :]) for c in plain}
        assert {c for c in product(*map(range, sizes)) if holds(algebra, made, c)} == want
        assert algebra.values(made, variable) == {c[variable] for c in want}
        for before, same in kept:
            assert (before == made) == (same == want)
        kept.append((made, want))


def test_a_variable_that_changes_twice_has_a_value_of_either() -> None:
    """Two outputs that are wired to one key; the larger sets contain the exact ones."""
    for algebra in (StateSets([4, 2]), ValueSets([4, 2])):
        changes = algebra.changes([(0, (1,), False), (1, (1,), True), (0, (2,), True)])
        made = algebra.write(algebra.start, changes)
        assert algebra.values(made, 0) == {1, 2}
        assert algebra.values(made, 1) == {0, 1}
