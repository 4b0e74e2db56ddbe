"""Which variables a search for a path must follow, and until when: all others cannot change the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from glotouch_bt.mission.check.data_flow import Flow
from glotouch_bt.mission.check.requirements import Demand, until_condition, verdicts
from glotouch_bt.mission.check.state_variables import UNSET
from glotouch_bt.mission.spec import ConditionSettings, NodeSpec, RepeatSettings

LOOPS = {"retry", "repeat", "for_each", "parallel"}


def deciding(flow: Flow) -> Iterator[int]:
    """Variables that change the way: those whose value lets a run end, or makes a comparison say something else."""
    for demand, asked in flow.asked.items():
        found = flow.variables.sets.values(asked, demand.variable)
        if len(found) > 1 and _tells_apart(flow, demand, found):
            yield demand.variable


def _tells_apart(flow: Flow, demand: Demand, found: frozenset[int]) -> bool:
    settings = demand.node.settings
    if isinstance(settings, RepeatSettings):
        settings = until_condition(settings)
    if isinstance(settings, ConditionSettings):
        yes, no = verdicts(flow.variables, demand, settings)
        return len({(v in yes, v in no) for v in found}) > 1
    return not found <= demand.good or (UNSET in found and demand.node.kind == "for_each")


def living(
    flow: Flow, nodes: Sequence[NodeSpec], index: Mapping[int, int], lasting: int | None
) -> list[frozenset[int]]:
    """Of the variables that are followed, the places of those that are still looked at from each node on.

    Args:
        flow: The analysis.
        nodes: All nodes, parents first.
        index: Place of each variable that is followed.
        lasting: A variable that is looked at when all is over, or None.
    """
    last: dict[int, int] = {} if lasting is None else {lasting: len(nodes)}
    looks: dict[int, set[int]] = {}
    for i, node in enumerate(nodes):
        for demand in flow.demands[id(node)]:
            if demand.variable in index:
                last[demand.variable] = i
                looks.setdefault(demand.variable, set()).add(i)
    living: list[frozenset[int]] = []
    loops: list[tuple[int, int]] = []  # round the present node: first node, and the first behind
    for i, node in enumerate(nodes):
        loops = [e for e in loops if e[1] > i]
        if node.kind in LOOPS:
            loops.append((i, i + sum(1 for _ in node.walk())))
        again = {v for v, at in looks.items() for first, end in loops if any(first <= j < end for j in at)}
        now = {v for v, at in last.items() if at >= i} | again
        living.append(frozenset(index[v] for v in now))
    return living
