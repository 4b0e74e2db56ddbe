"""The requirement of a port: which kinds of values its node works with."""

from __future__ import annotations

from typing import Any, Literal

from glotouch_bt.mission.nodes.base.analysis import Requirement
from glotouch_bt.mission.nodes.base.comparison import ConditionSettings, compared_type
from glotouch_bt.mission.nodes.base.state_variables import UNSET, StateVariables, ValueKind
from glotouch_bt.mission.spec import NodeSpec


def port_requirement(
    node: NodeSpec,
    port: str,
    variables: StateVariables,
    unset: Literal["never", "not always", "allowed"],
    wanted: Any,
    unit: str = "",
    element: type = object,
) -> Requirement:
    """Return the requirement of a wired port; the arguments are those of `Requirement`."""
    key, place = node.reads[port].key, node.reads[port].place
    good = {v for v in variables.written(key) if _fits(variables.kind(key, v), wanted, unit, element)}
    if unset != "never":
        good.add(UNSET)
    return Requirement(node, port, key, variables.keys[key], place, frozenset(good), unset, wanted, unit, element)


def comparison_requirement(
    node: NodeSpec, variables: StateVariables, port: str, settings: ConditionSettings
) -> Requirement:
    """Return the requirement of a port that is compared; unwritten, every comparison but `is_set` fails."""
    unset: Literal["not always", "allowed"] = "not always" if settings.is_set is None else "allowed"
    return port_requirement(node, port, variables, unset, compared_type(settings), node.reads[port].unit)


def _fits(kind: ValueKind, wanted: Any, unit: str = "", element: type = object) -> bool:
    """True if a value of a kind passes py_trees' run-time check of `wanted`, has such items, and has the same unit.

    Unknown types pass, and so do names without a unit.
    """
    if kind.unit and unit and kind.unit != unit:
        return False
    if object not in (kind.element, element) and not issubclass(kind.element, element):
        return False
    given = kind.data_type
    if given is object or wanted is object:
        return True
    options = getattr(wanted, "__args__", None) if not isinstance(wanted, type) else (wanted,)
    plain = [o for o in options or () if isinstance(o, type)]
    if not plain:
        return True
    if given is bool and bool not in plain:
        return False
    return any(issubclass(given, o) for o in plain)
