"""Messages of `check` help: the nearest name, where it belongs, which types there are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.spec.findings import Finding, Findings, MissionFaults

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


@pytest.fixture
def findings_of(tmp_path: Path) -> Callable[[str], list[Finding]]:
    """The findings of a tree of shipped skills."""

    def check(tree: str) -> list[Finding]:
        (tmp_path / "m.yaml").write_text(f"{HEAD}tree:\n{tree}")
        with pytest.raises(MissionFaults) as e:
            load_mission(tmp_path / "m.yaml")
        return e.value.findings

    return check


@pytest.mark.parametrize(("value", "hint"), [("60", "60 mm"), ("400", ""), ("-60", ""), ("0.4 m", ""), ("60 cm", "")])
def test_a_number_that_fits_in_millimetres(findings_of: Callable[[str], list[Finding]], value: str, hint: str) -> None:
    (found,) = (f for f in findings_of(f"  - lift: {{height_m: {value}}}\n") if f.code == "wrong_range")
    assert found.hint == hint


def test_an_unset_port_names_the_skills_that_write_it(findings_of: Callable[[str], list[Finding]]) -> None:
    said = [f.what for f in findings_of("  - orbit_probe\n") if f.code == "port_unset"]
    reads = "'orbit_probe' reads port 'contact', which no node writes before it"
    assert f"{reads}; skills that write it: guarded_sweep" in said


@pytest.mark.parametrize(
    "tree",
    [
        "  tare\n    tool_pickup\n",
        "\n    tare:\n    tool_pickup:\n",
        "\n    do:\n      tare:\n      tool_pickup:\n",
        "\n    do: tare\n",
        "\n    tool_pickup: {grip_N: 30 N}\n",
    ],
)
def test_children_without_dashes(findings_of: Callable[[str], list[Finding]], tree: str) -> None:
    (found,) = findings_of(f"  sequence:{tree}")
    said = "the children of sequence are a list: begin each of them with '- '"
    assert (found.code, found.what) == ("not_a_node", said)


def test_a_name_that_is_not_allowed_is_a_sentence(load: Callable[..., Any]) -> None:
    with pytest.raises(MissionFaults, match="mission name 'my mission' has characters that are not allowed"):
        load("mission: my mission\nworld: container_five\ntree: {find: {}}\n")


def test_a_range_of_one_number(load: Callable[..., Any]) -> None:
    with pytest.raises(MissionFaults, match=r"range: has too few items \(valid: \[float, float\]\)"):
        load(HEAD + "parameters: {n: {type: int, default: 2, range: [3]}}\ntree: {find: {how_many: $n}}\n")
