"""Every seeded mistake is found on its line; nothing is found in missions that are right."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read.library import shipped
from glotouch_bt.mission.spec.findings import Finding
from glotouch_bt.validation.seeded_mistakes.bench import alarms
from glotouch_bt.validation.seeded_mistakes.mistakes import MISTAKES, RIGHT, Mistake

Found = Callable[..., list[Finding]]


@pytest.mark.parametrize("mistake", MISTAKES, ids=[m.name for m in MISTAKES])
def test_each_mistake_is_found_on_its_line(mistake: Mistake, found_in: Found) -> None:
    found = found_in(mistake.text)
    told = "\n".join(str(f) for f in found)
    meant = [f for f in found if f.code == mistake.code and f.place.line == mistake.line]
    assert meant, told
    assert any(mistake.word in str(f) for f in meant), told
    looks = {"port_unset", "port_maybe_unset", "port_type", "port_unit", "wrong_state", "wrong_end"}
    if mistake.code in looks and not any(f.place.line < mistake.line for f in found):
        assert any(len(f.path) > 1 or f.code == "port_unset" for f in meant), told


def test_there_are_at_least_forty() -> None:
    assert len({m.name for m in MISTAKES}) == len(MISTAKES) >= 40
    assert len(RIGHT) >= 20


@pytest.mark.parametrize("name", RIGHT)
def test_nothing_is_found_in_what_is_right(name: str, found_in: Found) -> None:
    assert [str(f) for f in found_in(RIGHT[name])] == []


@pytest.mark.parametrize("name", shipped(""))
def test_nothing_is_found_in_what_is_shipped(name: str) -> None:
    assert [str(w) for w in alarms(load_mission(name).warnings)] == []
