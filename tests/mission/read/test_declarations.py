"""The declarations of a skill are checked when it is loaded."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from pydantic import ValidationError

from glotouch_bt.mission.read import SkillRegistry
from glotouch_bt.mission.read.declarations import declaration_fault
from glotouch_bt.skill import Skill, SkillParams, param


def declaring(unit: str = "N", **attributes: Any) -> type[Skill]:
    """Return a skill with one parameter and some class attributes."""

    class OneParams(SkillParams):
        force_N: float = param("Force", unit=unit, default=1.0, ge=0.5)

    return type("Declaring", (Skill,), {"Params": OneParams, **attributes})


def test_what_may_be_declared() -> None:
    good = declaring(PRECONDITIONS={"hand": frozenset({"empty"})}, POSTCONDITIONS={"hand": "empty"}, USES={"arm"})
    assert declaration_fault(good) == ""
    for name in SkillRegistry():
        assert declaration_fault(SkillRegistry()[name]) == ""


@pytest.mark.parametrize(
    ("unit", "attributes", "said"),
    [
        ("Newton", {}, "parameter 'force_N': unknown unit 'Newton' (valid: m, "),
        ("", {}, "parameter 'force_N': its name ends in N, but its unit is '': write unit='N'"),
        ("m", {}, "parameter 'force_N': its name ends in N, but its unit is 'm': write unit='N'"),
        ("N", {"PRECONDITIONS": {"hand": "empty"}}, "PRECONDITIONS['hand'] is 'empty': it must be a set of states"),
        ("N", {"FAILURE_STATES": {"hand": {1}}}, "FAILURE_STATES['hand'] is {1}: it must be a set of states"),
        ("N", {"POSTCONDITIONS": {"hand": {"empty"}}}, "POSTCONDITIONS['hand'] is {'empty'}: it must be one state"),
        ("N", {"USES": "arm"}, "USES is 'arm': it must be a set of resources"),
    ],
)
def test_what_may_not(unit: str, attributes: dict[str, Any], said: str) -> None:
    assert declaration_fault(declaring(unit, **attributes)).startswith(said)


def test_a_default_obeys_its_own_range() -> None:
    class HalfParams(SkillParams):
        share: float = param("A share", default=0.2, ge=1.0)

    class Half(Skill):
        Params: ClassVar = HalfParams

    with pytest.raises(ValidationError, match="greater than or equal to 1"):
        Half.Params()
