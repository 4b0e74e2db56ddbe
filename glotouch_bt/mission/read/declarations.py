"""Check what a skill declares: the units of its parameters and the states of resources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from glotouch_bt.mission.spec import UNITS, unit_of_name
from glotouch_bt.skill import Skill


def declaration_fault(skill: type[Skill]) -> str:
    """Return what is wrong with a skill's declarations; empty if nothing is."""
    for name, field in skill.Params.model_fields.items():
        extra = field.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, Mapping) else ""
        if unit and unit not in UNITS:
            return f"parameter {name!r}: unknown unit {unit!r} (valid: {', '.join(UNITS)})"
        named = unit_of_name(name) if field.annotation in (int, float) else ""
        if named and unit != named:
            return f"parameter {name!r}: its name ends in {named}, but its unit is {unit!r}: write unit={named!r}"
    for declared in ("PRECONDITIONS", "FAILURE_STATES"):
        for resource, states in getattr(skill, declared).items():
            if not isinstance(states, set | frozenset) or not all(isinstance(s, str) for s in states):
                wanted = "it must be a set of states, such as frozenset({'empty'})"
                return f"{declared}[{resource!r}] is {states!r}: {wanted}"
    after: Mapping[str, Any] = skill.POSTCONDITIONS
    for resource, state in after.items():
        if not isinstance(state, str):
            return f"POSTCONDITIONS[{resource!r}] is {state!r}: it must be one state, such as 'empty'"
    uses: Any = skill.USES
    if not isinstance(uses, set | frozenset):
        return f"USES is {uses!r}: it must be a set of resources, such as frozenset({{'arm'}})"
    return ""
