"""Parameters of a skill: pydantic fields with a description and a unit."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class SkillParams(BaseModel):
    """Base of every skill's parameters; YAML keys are the field names.

    Unknown keys are errors, and so are defaults outside their own range.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)


def param(
    description: str,
    *,
    unit: str = "",
    names: str = "",
    needs: str = "",
    default: Any = ...,
    **rules: Any,
) -> Any:
    """Return one parameter as a pydantic field.

    Args:
        description: One line for people.
        unit: Its unit; empty: none.
        names: "stl" if its text is the path of an STL file, or the name of one in the world's folder.
        needs: Optional part of a `robot.Gripper` without which the parameter must stay false, by its name there.
        default: Its default; none: it is required.
        rules: Rules of pydantic (ge, le, gt, ...).
    """
    extra: dict[str, Any] = {"unit": unit, "names": names} | ({"needs": needs} if needs else {})
    return Field(default, description=description, json_schema_extra=extra, **rules)
