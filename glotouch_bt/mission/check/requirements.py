"""The requirements of all nodes of a tree, and the results that comparisons may have."""

from __future__ import annotations

from collections.abc import Mapping

from glotouch_bt.mission.nodes import UNSET, ConditionSettings, Requirement, StateVariables, holds, kind_of
from glotouch_bt.mission.spec import NodeSpec

Requirements = Mapping[int, tuple[Requirement, ...]]
"""Those of each node, by node id."""


def all_requirements(tree: NodeSpec, variables: StateVariables) -> Requirements:
    """Return the requirements of every node of a tree."""
    return {id(n): tuple(kind_of(n).requirements(n, variables)) for n in tree.walk()}


def verdicts(
    variables: StateVariables, requirement: Requirement, settings: ConditionSettings
) -> tuple[set[int], set[int]]:
    """Return the values of a requirement's variable with which a comparison may hold, and with which it may fail."""
    holding, failing = set(), set()
    for value in {UNSET, *requirement.good}:
        fixed = None if value == UNSET else variables.kind(requirement.key, value).value
        free = value != UNSET and fixed is None and settings.is_set is None
        # A written value is not None: for `is_set` any other value does.
        held = holds(settings, None if value == UNSET else True if fixed is None else fixed)
        if free or held:
            holding.add(value)
        if free or not held:
            failing.add(value)
    return holding, failing
