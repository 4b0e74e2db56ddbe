"""Unknown names hide nothing below them."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from glotouch_bt.mission.spec import Finding

HEAD = "mission: m\nworld: worlds/container_five.yaml\n"
BELOW = """
    - tool_pickup
    - graps
    - guarded_sweep: {expected_object: 3}
    - orbit_probe: {min_contacts: few}
    - lift: {in: {grip_m: grib_m}}
    - timeout: {seconds: 60 mm, do: tool_return}
    - match: {target: aple}
"""
CODES = ["unknown_skill", "unknown_parameter", "wrong_type", "wrong_unit", "no_such_stl"]
Found = Callable[..., list[Finding]]


def codes_below(found: list[Finding], line: int) -> list[str]:
    return [f.code for f in found if f.place.line > line and f.code in CODES]


@pytest.mark.parametrize("name", ["sequence", "Sequence", "Fallback", "nothing_like_it"])
def test_an_unknown_name_hides_no_mistake_below_it(name: str, found_in: Found) -> None:
    found = found_in(f"{HEAD}tree:\n  {name}:{BELOW}")
    assert codes_below(found, 4) == CODES
    assert ("unknown_skill" in [f.code for f in found if f.place.line == 4]) == (name != "sequence")
    assert "unreachable" not in {f.code for f in found}


def test_an_unknown_name_with_do_hides_no_mistake_below_it(found_in: Found) -> None:
    found = found_in(
        f"{HEAD}tree:\n  - succed: {{do: {{tare: {{naem: 1}}}}}}\n  - xxyyzz: {{do: {{tare: {{naem: 1}}}}}}\n"
    )
    assert [(f.code, f.place.line) for f in found if f.severity == "error"] == [
        ("unknown_skill", 4),
        ("unknown_parameter", 4),
        ("unknown_skill", 5),
        ("unknown_parameter", 5),
    ]


def test_a_parameter_used_only_below_an_unknown_name_is_used(found_in: Found) -> None:
    text = (
        HEAD
        + "parameters:\n  n: {type: int, default: 5}\ntree:\n  Sequense: [{guarded_sweep: {expected_objects: $n}}]\n"
    )
    assert "unused_parameter" not in {f.code for f in found_in(text)}
