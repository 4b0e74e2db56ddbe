"""The comparison of a key's value with a constant, as a condition and the `until` of a repeat make it."""

from __future__ import annotations

import json
import re
from typing import Any

from pydantic import Field
from pydantic.config import JsonDict

from glotouch_bt.mission.nodes.base.btcpp import btcpp_key, btcpp_value
from glotouch_bt.mission.spec import Findings, Place, Settings

ANY_UNIT: JsonDict = {"any_unit": True}
"""Marks a number that may be written in any unit; it is compared in the unit of the key."""
_SCRIPT_TEXT = re.compile("[ -&(-~]*")
"""Text that a script may quote. Source: BehaviorTree.CPP 4.8, `StringLiteral` of its script grammar."""
_SIGNS = (("equals", "=="), ("at_least", ">="), ("at_most", "<="))


class ConditionSettings(Settings):
    """Compare a port's value; a port that nobody has written yet fails every comparison but `is_set: false`."""

    port: str = Field(description="key to look at")
    equals: bool | int | float | str | None = Field(default=None, description="succeed if equal")
    at_least: float | None = Field(
        default=None, description="succeed if the number is at least this", json_schema_extra=ANY_UNIT
    )
    at_most: float | None = Field(
        default=None, description="succeed if the number is at most this", json_schema_extra=ANY_UNIT
    )
    is_set: bool | None = Field(default=None, description="succeed if somebody wrote it (false: nobody)")

    def check(self, place: Place, findings: Findings) -> None:
        """Report a comparison that is missing, or more than one."""
        asked = [n for n in ("equals", "at_least", "at_most", "is_set") if getattr(self, n) is not None]
        if len(asked) != 1:
            found = " and ".join(asked) or "none"
            what = f"a condition needs exactly one comparison, found {found}"
            findings.add(place, "wrong_value", what, valid="equals, at_least, at_most, is_set")


def holds(comparison: ConditionSettings, value: Any) -> bool:
    """Return the result of a comparison; an unset key (None) fails all but `is_set: false`."""
    if comparison.is_set is not None:
        return (value is not None) == comparison.is_set
    if value is None:
        return False
    if comparison.equals is not None:
        return isinstance(value, bool) == isinstance(comparison.equals, bool) and bool(value == comparison.equals)
    if comparison.at_least is not None:
        return bool(value >= comparison.at_least)
    return comparison.at_most is not None and bool(value <= comparison.at_most)


def in_words(comparison: ConditionSettings) -> str:
    """Return the comparison for people: `found is at least 1`."""
    return f"{comparison.port} is {_wanted(comparison)}"


def failure_in_words(comparison: ConditionSettings, value: Any) -> str:
    """Return why a comparison with a value fails: `found is 5, not at most 3`; None is a port that is not set."""
    if value is None or comparison.is_set is not None:
        return f"{comparison.port} is {'not set' if value is None else 'set'}"
    return f"{comparison.port} is {_value_in_words(value)}, not {_wanted(comparison)}"


def _wanted(comparison: ConditionSettings) -> str:
    """Return the values for which the comparison holds: `at least 1`."""
    if comparison.is_set is not None:
        return "set" if comparison.is_set else "not set"
    words = (("", comparison.equals), ("at least ", comparison.at_least), ("at most ", comparison.at_most))
    return next((f"{word}{_value_in_words(value)}" for word, value in words if value is not None), "set")


def _value_in_words(value: Any) -> str:
    """Return a value as a mission file has it: `true`, `0.02`, `'outline'`."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    return repr(value) if isinstance(value, (int, str)) else "another value"


def in_code(comparison: ConditionSettings, key: str) -> str | None:
    """Return the comparison in BehaviorTree.CPP's script language; None if that language cannot express it.

    It knows no test for a key that is not set, and takes only printable ASCII without `'` as text.
    """
    for word, sign in _SIGNS:
        wanted = getattr(comparison, word)
        if isinstance(wanted, str):
            return f"{key} {sign} '{wanted}'" if _SCRIPT_TEXT.fullmatch(wanted) else None
        if wanted is not None:
            return f"{key} {sign} {json.dumps(wanted)}"
    return None


def comparison_ports(comparison: ConditionSettings, key: str) -> dict[str, str]:
    """Return the comparison as the ports of a node that BehaviorTree.CPP lacks."""
    given = comparison.model_dump(exclude_none=True, exclude={"port"})
    return {"port": btcpp_key(key), **{name: btcpp_value(value) for name, value in given.items()}}


def compared_type(comparison: ConditionSettings) -> Any:
    """Return the type a comparison's port must have."""
    if comparison.at_least is not None or comparison.at_most is not None:
        return int | float
    if comparison.equals is None:
        return object
    number = isinstance(comparison.equals, (int, float)) and not isinstance(comparison.equals, bool)
    return int | float if number else type(comparison.equals)
