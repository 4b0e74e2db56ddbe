"""The variables that a search for a path must follow, and how long: all others cannot change its course."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from glotouch_bt.mission.check.data_flow import DataFlow
from glotouch_bt.mission.check.requirements import verdicts
from glotouch_bt.mission.nodes import UNSET, Requirement, kind_of
from glotouch_bt.mission.spec import NodeSpec


def deciding(flow: DataFlow) -> Iterator[int]:
    """Yield the variables whose value decides whether a run goes on, or how a comparison ends."""
    for requirement in flow.looked:
        found = flow.values(requirement)
        if len(found) > 1 and _decides(flow, requirement, found):
            yield requirement.variable


def followed(coarse: DataFlow) -> set[int]:
    """Return the variables that an exact analysis must follow, given one that takes each variable on its own.

    Besides those that decide, it follows the variables of which a finding may need the exact values: keys that are
    unwritten on some paths only, keys that are compared, what a loop over items reads and writes, and resources. It
    follows any variable that may not meet a requirement, too.
    """
    variables, found = coarse.variables, set(deciding(coarse))
    found.update(range(len(variables.keys), len(variables.sizes)))
    for node in coarse.tree.walk():
        if kind_of(node).branches_on_unset:
            found.update(variables.keys[wire.key] for wire in (*node.reads.values(), *node.writes.values()))
    for requirement in coarse.looked:
        values = coarse.found(requirement)
        partly = UNSET in values and requirement.unset != "allowed"
        compared = kind_of(requirement.node).comparison(requirement.node) is not None
        if compared or values - requirement.good or (partly and len(values) > 1):
            found.add(requirement.variable)
    return found


def _decides(flow: DataFlow, requirement: Requirement, found: frozenset[int]) -> bool:
    kind = kind_of(requirement.node)
    compared = kind.comparison(requirement.node)
    if compared is not None:
        yes, no = verdicts(flow.variables, requirement, compared[1])
        return len({(v in yes, v in no) for v in found}) > 1
    return not found <= requirement.good or (UNSET in found and kind.branches_on_unset)


def living(
    flow: DataFlow, nodes: Sequence[NodeSpec], index: Mapping[int, int], lasting: int | None
) -> list[frozenset[int]]:
    """Return, for each node, the places of the followed variables that this node or a later one still reads.

    Args:
        flow: The analysis.
        nodes: All nodes, parents first.
        index: Place of each followed variable.
        lasting: A variable that is read when the mission is over, or None.
    """
    last: dict[int, int] = {} if lasting is None else {lasting: len(nodes)}
    looks: dict[int, set[int]] = {}
    for i, node in enumerate(nodes):
        for requirement in flow.requirements[id(node)]:
            if requirement.variable in index:
                last[requirement.variable] = i
                looks.setdefault(requirement.variable, set()).add(i)
    living: list[frozenset[int]] = []
    loops: list[tuple[int, int]] = []  # loops around the present node: first node, and the first one after it
    for i, node in enumerate(nodes):
        loops = [e for e in loops if e[1] > i]
        if kind_of(node).revisits:
            loops.append((i, i + sum(1 for _ in node.walk())))
        again = {v for v, at in looks.items() for first, end in loops if any(first <= j < end for j in at)}
        now = {v for v, at in last.items() if at >= i} | again
        living.append(frozenset(index[v] for v in now))
    return living
