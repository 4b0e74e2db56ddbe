"""Parameters of a skill: pydantic fields with a description and a unit."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class SkillParams(BaseModel):
    """Base of every skill's parameters; YAML keys are the field names. Unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def param(description: str, *, unit: str = "", names: str = "", default: Any = ..., **rules: Any) -> Any:
    """One parameter: a description, its unit, a default (none: required) and pydantic rules (ge, le, gt, ...).

    `names="stl"`: its text is the path of an STL file or the name of one in the world's folder, which must be there.
    """
    return Field(default, description=description, json_schema_extra={"unit": unit, "names": names}, **rules)
