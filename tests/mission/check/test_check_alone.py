"""One mistake, one finding: nothing is reported that only follows from it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.spec.findings import Finding, MissionFaults
from glotouch_bt.validation.seeded_mistakes.mistakes import MISSION

Found = Callable[..., list[Finding]]

# (what, is replaced by, code, a piece of the line)
ALONE = [
    ("limit: 60", "limit: 1_000", "wrong_type", "limit: 1_000"),
    ("until: complete", "until: true", "wrong_type", "until: true"),
    ("until: complete", "until: {port: found, at_least: three}", "wrong_type", "at_least: three"),
    ("on_failure: continue", "on_failure: skip", "wrong_type", "on_failure: skip"),
    ("{touchset: touchsets}", "touchset", "wrong_type", "collect: touchset"),
    ("        do: squeeze\n", "        do:\n", "no_children", "- for_each:  # 2"),
    ("    - selector:\n", "    - alternatives:\n", "unknown_skill", "- alternatives:"),
    ("    - tool_pickup\n", "    - pick_up_the_tool\n", "unknown_skill", "- pick_up_the_tool"),
    ("{port: exhausted, equals: true}", "{port: exhausted, equals: yes}", "port_type", "equals: yes"),
    ("- retry: {attempts: 2, do: tool_calibrate}", "- retry: {attempts: 2, do: []}", "no_children", "do: []"),
]


@pytest.mark.parametrize(("old", "new", "code", "at"), ALONE, ids=[a[1].strip() for a in ALONE])
def test_a_mistake_is_found_alone(old: str, new: str, code: str, at: str, found_in: Found) -> None:
    text = MISSION.replace("    - for_each:\n        name: squeeze", "    - for_each:  # 2\n        name: squeeze")
    assert text.count(old) == 1
    text = text.replace(old, new)
    (line,) = [i for i, written in enumerate(text.splitlines(), 1) if at in written]
    assert [(f.code, f.place.line) for f in found_in(text)] == [(code, line)]


def test_a_value_that_does_not_fit_is_found_alone() -> None:
    """It is handed on to subtrees, which are read all the same."""
    with pytest.raises(MissionFaults) as e:
        load_mission("retrieve", {"expected_objects": "five"})
    assert [str(f.place) for f in e.value.findings] == ["--set expected_objects"]
