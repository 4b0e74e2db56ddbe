"""Messages of `check` help: the nearest name, where it belongs, which types there are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.spec.findings import Findings, MissionFaults

HEAD = "mission: m\nworld: container_five\n"

HINTS = [
    ("fallback: [find]", "did you mean 'selector'?"),
    ("retry_until_successful: {attempts: 2, do: find}", "did you mean 'retry'?"),
    ("force_success: find", "did you mean 'succeed'?"),
    ("Find", "did you mean 'find'?"),
    ("foreach: {items: a, item: b, do: find}", "did you mean 'for_each'?"),
    ("parallel: {policy: All, do: [act, act]}", "must be 'all' or 'one'; did you mean 'all'?"),
    ("selector: {child: [find, act]}", "(valid: do, name)"),
    ("act: {nam: x}", "(valid: code, in, name, out, script)"),
    ("use: {force_N: 1, item: things}", "'item' is not a parameter of skill 'use': write it under in:"),
    ("use: {force_N: 1, mark: mine}", "'mark' is not a parameter of skill 'use': write it under out:"),
    ("use: {in: {force_N: 1}}", "'force_N' of skill 'use' is a parameter, not a port: write it outside of in:"),
    ("repeat: {until: {port: found, atleast: 3}, do: find}", "did you mean 'at_least'?"),
    ("repeat: {until: [found], do: find}", "(valid: str)"),
    ("[find, {for_each: {items: items, item: i, collect: mark, do: act}}]", "(valid: a mapping)"),
]


@pytest.mark.parametrize(("tree", "words"), HINTS, ids=[h[0] for h in HINTS])
def test_the_way_out_is_said(tree: str, words: str, load: Callable[..., Any]) -> None:
    with pytest.raises(MissionFaults) as e:
        load(f"  {tree}\n")
    assert words in str(e.value)
    assert "pydantic" not in str(e.value)
    assert "glotouch_bt." not in str(e.value)


def test_one_finding_for_a_misspelt_key_of_a_condition_inside_a_loop(load: Callable[..., Any]) -> None:
    with pytest.raises(MissionFaults) as e:
        load("  repeat: {until: {port: found, atleast: 3}, do: find}\n")
    assert len(e.value.findings) == 1


@pytest.mark.parametrize(("given", "valid", "nearest"), [
    ("MM/s", ["m/s", "mm/s"], "mm/s"),
    ("atleast", ["at_least", "at_most"], "at_least"),
    ("tool-pickup", ["tool_pickup"], "tool_pickup"),
    ("xyz", ["abc"], ""),
    ("", ["abc"], ""),
    ("--", ["abc"], ""),
])  # fmt: skip
def test_capitals_and_separators_do_not_count(given: str, valid: list[str], nearest: str) -> None:
    assert Findings.nearest(given, valid) == nearest


def test_a_range_of_one_number(load: Callable[..., Any]) -> None:
    with pytest.raises(MissionFaults, match=r"range: has too few items \(valid: \[float, float\]\)"):
        load(HEAD + "parameters: {n: {type: int, default: 2, range: [3]}}\ntree: {find: {how_many: $n}}\n")
