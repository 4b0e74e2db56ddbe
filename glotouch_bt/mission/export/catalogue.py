"""Skills described for people and programs: parameters with units and ranges, typed ports."""

from __future__ import annotations

import inspect
from typing import Any

from pydantic_core import PydanticUndefined

from glotouch_bt.mission.read import unit_of
from glotouch_bt.skill import Skill

_LIMITS = (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<="))


def describe_skill(name: str, skill: type[Skill]) -> dict[str, Any]:
    """A skill as JSON data: name, description, parameters, inputs, outputs, states of resources, failures."""
    keys = skill.default_keys()
    parameters: list[dict[str, Any]] = []
    for field_name, field in skill.Params.model_fields.items():
        limits = [f"{sign} {getattr(m, word):g}" for m in field.metadata for word, sign in _LIMITS if hasattr(m, word)]
        required = field.default is PydanticUndefined
        parameters.append(
            {
                "name": field_name,
                "type": getattr(field.annotation, "__name__", str(field.annotation)),
                "unit": unit_of(field),
                "required": required,
                "default": None if required else field.default,
                "range": ", ".join(limits),
                "description": field.description or "",
            }
        )
    return {
        "name": name,
        "description": inspect.cleandoc(skill.__doc__ or ""),
        "parameters": parameters,
        "inputs": [{**_port(p, info, keys), "required": bool(info.required)} for p, info in skill.INPUT_PORTS.items()],
        "outputs": [_port(p, info, keys) for p, info in skill.OUTPUT_PORTS.items()],
        "needs": {r: sorted(s) for r, s in skill.PRECONDITIONS.items()},
        "leaves": dict(skill.POSTCONDITIONS),
        "after_failure": {r: sorted(s) for r, s in skill.FAILURE_STATES.items()},
        "uses": sorted(skill.USES),
        "failures": skill.failure_codes(),
        "pause": skill.PAUSE,
    }


def _port(name: str, info: Any, keys: dict[str, str]) -> dict[str, Any]:
    kind = getattr(info.data_type, "__name__", str(info.data_type))
    return {"name": name, "type": kind, "key": keys[name], "description": info.description}
