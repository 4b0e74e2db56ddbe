"""Units of mission parameters: converted wherever a value is handed on, refused where they measure something else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.nodes import ConditionSettings
from glotouch_bt.mission.spec.findings import Finding, MissionFaults

HEAD = "mission: m\nworld: container_five\n"
Load = Callable[..., Any]

SUBTREE = (
    HEAD
    + "parameters:\n  speed: {{type: float, {outer}}}\n"
    + "subtrees:\n  s:\n    parameters: {{v: {{type: float, {inner}}}}}\n    tree: {{find: {{speed_m_s: $v}}}}\n"
    + "tree:\n  subtree: {{file: s, parameters: {{v: {given}}}}}\n"
)


def found_in(load: Load, text: str) -> list[Finding]:
    try:
        return list(load(text).warnings)
    except MissionFaults as e:
        return e.findings


@pytest.mark.parametrize(
    ("outer", "inner", "given"),
    [
        ("unit: cm/s, default: 3", "unit: mm/s, default: 9", "$speed"),
        ("unit: cm/s, default: 3", "default: 0.09", "$speed"),
        ("unit: m/s, default: 0.03", "unit: mm/s, default: 9, range: [10, 60]", "$speed"),
        ("unit: mm/s, default: 3 cm/s", "unit: m/s, default: 0.09", "$speed"),
        ("default: 3 cm/s", "unit: m/s, default: 0.09", "$speed"),
        ("default: 1", "unit: mm/s, default: 9", "0.03 m/s"),
    ],
)
def test_a_speed_stays_the_same_speed_in_a_subtree(outer: str, inner: str, given: str, load: Load) -> None:
    mission = load(SUBTREE.format(outer=outer, inner=inner, given=given))
    (leaf,) = [n for n in mission.spec.walk() if n.skill]
    assert leaf.params.speed_m_s == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("outer", "inner", "given", "code", "words"),
    [
        ("unit: N, default: 3", "unit: mm/s, default: 9", "$speed", "wrong_unit", "is in mm/s, not 'N' (from $speed)"),
        ("default: 1", "unit: mm/s, default: 9", "3 kg", "wrong_unit", "not 'kg'"),
        ("default: 1", "unit: mm/s, default: 9, range: [10, 60]", "70", "wrong_value", "[10, 60] mm/s"),
        ("default: 1", "unit: mm/s, default: 9", "fast", "wrong_value", "must be a number"),
        ("default: 1", "unit: mm/s", "", "missing_parameter", "give it with parameters: {v: ...}"),
        (
            "unit: cm/s, default: 3, range: [1, 70]",
            "unit: mm/s, default: 9, range: [10, 90]",
            "$speed",
            "range_too_wide",
            "70 cm/s, but v must be in [10, 90] mm/s",
        ),
    ],
)  # fmt: skip
def test_what_a_subtree_cannot_take_is_found_where_it_is_given(
    outer: str, inner: str, given: str, code: str, words: str, load: Load
) -> None:
    text = SUBTREE.format(outer=outer, inner=inner, given=given)
    text = text if given else text.replace(", parameters: {v: }", "")
    found = [f for f in found_in(load, text) if f.code == code]
    assert [f.place.line for f in found] == [10]
    assert words in found[0].what


def test_a_faulty_parameter_is_the_only_finding_about_its_subtree(load: Load) -> None:
    text = SUBTREE.format(outer="unit: mm/s, default: fast", inner="unit: mm/s, default: 9", given="$speed")
    text = text.replace("tree:\n  subtree", "tree:\n  - number\n  - subtree")
    assert [(f.place.line, f.code) for f in found_in(load, text)] == [(4, "wrong_value"), (10, "port_unset")]


@pytest.mark.parametrize("written", ["40 mm", "4 cm", "0.04 m", "0.04", "$w"])
@pytest.mark.parametrize("node", ["condition: C", "repeat: {until: C, do: {find: {out: {found: width_m}}}}"])
def test_a_condition_compares_in_si(written: str, node: str, load: Load) -> None:
    text = HEAD + "parameters: {w: {type: float, unit: mm, default: 40}}\ntree:\n  - find: {out: {found: width_m}}\n"
    tree = load(text + "  - " + node.replace("C", f"{{port: width_m, at_least: {written}}}") + "\n").spec
    compared = [s for n in tree.walk() for s in (n.settings, getattr(n.settings, "until", None))]
    (settings,) = [s for s in compared if isinstance(s, ConditionSettings)]
    assert settings.at_least == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("node", "place"),
    [
        ("condition: {port: grip_m, at_least: 4 N}", (7, 23)),
        ("condition: {port: grip_m, at_least: $w}", (7, 23)),
        ("repeat: {until: {port: grip_m, at_most: 4 N}, limit: 2, do: [put_back, PLAN]}", (7, 28)),
    ],
)
def test_a_condition_in_another_quantity(node: str, place: tuple[int, int], tmp_path: Path) -> None:
    text = HEAD + "parameters: {w: {type: float, unit: N, default: 40}}\ntree:\n"
    plan = (
        "{grasp: {in: {plan: {candidate: 0, position_K_m: [0, 0, 0], yaw_rad: 0, aperture_m: 0.05, opening_m: 0.08}}}}"
    )
    path = tmp_path / "m.yaml"
    path.write_text(text + f"  - tare\n  - PLAN\n  - {node}\n".replace("PLAN", plan))
    with pytest.raises(MissionFaults) as e:
        load_mission(path)
    (found,) = e.value.findings
    assert ((found.place.line, found.place.column), found.code) == (place, "port_unit")
    assert "in N, but 'grasp' (line 6) writes it in m: another quantity" in found.what


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("retry: {attempts: $w, do: find}", "wrong_unit", "attempts has no unit; given in 'mm' (from $w)"),
        ("find: {how_many: $w}", "wrong_unit", "how_many has no unit"),
        ("[find, {condition: {port: found, at_least: 3 furlongs}}]", "wrong_unit", "unknown unit 'furlongs'"),
    ],
)
def test_a_unit_where_none_belongs(line: str, code: str, words: str, load: Load) -> None:
    text = HEAD + f"parameters: {{w: {{type: int, unit: mm, default: 2}}}}\ntree:\n  {line}\n"
    found = [f for f in found_in(load, text) if f.code == code]
    assert len(found) == 1
    assert words in found[0].what


@pytest.mark.parametrize(
    ("declared", "column", "code", "words"),
    [
        ("type: float, unit: mmm/s, default: 30", 30, "wrong_unit", "unknown unit 'mmm/s'"),
        ("type: float, unit: mm/s, default: 30 N", 45, "wrong_unit", "speed is in mm/s, not 'N'"),
        ("type: float, unit: mm/s, default: 30, range: [60, 10]", 56, "wrong_value", "[60, 10]: the range is empty"),
        ("type: int, default: 1.5 m", 31, "wrong_value", "must be a whole number"),
    ],
)
def test_a_wrong_declaration_is_one_finding(declared: str, column: int, code: str, words: str, load: Load) -> None:
    text = HEAD + f"parameters:\n  speed: {{{declared}}}\ntree:\n  find: {{speed_m_s: $speed}}\n"
    (found,) = found_in(load, text)
    assert (found.place.line, found.place.column, found.code) == (4, column, code)
    assert words in found.what


PLAN = "candidate: 0, position_K_m: [0, 0, 25 mm], yaw_rad: 30 deg, aperture_m: 50 mm, opening_m: 80 mm"


def lifted(plan: str, grip: str = "grip_m") -> str:
    tree = f"  - tare\n  - grasp: {{in: {{plan: {{{plan}}}}}}}\n  - lift: {{in: {{grip_m: {grip}}}}}\n"
    return HEAD + "leaves: {hand: object}\ntree:\n" + tree


@pytest.mark.parametrize(
    ("old", "new", "code", "words"),
    [
        ("25 mm", "25", "wrong_value", "[x, y, z] in metres"),
        ("[0, 0, 25 mm]", "[0, 25 mm]", "wrong_value", "[x, y, z] in metres"),
        ("30 deg", "30", "wrong_value", "radians"),
        ("aperture_m: 50 mm", "aperture_m: 50", "wrong_value", "in metres"),
        ("aperture_m: 50 mm", "aperture_m: -50 mm", "wrong_value", "in metres"),
        ("candidate: 0", "candidate: 0, alternatives: [1]", "wrong_type", "alternatives: must be left out"),
    ],
)
def test_a_plan_in_the_wrong_unit(old: str, new: str, code: str, words: str, tmp_path: Path) -> None:
    """A grasp 25 m above the floor is not tried: the numbers are looked at where they stand."""
    path = tmp_path / "m.yaml"
    path.write_text(lifted(PLAN.replace(old, new)))
    with pytest.raises(MissionFaults) as e:
        load_mission(path)
    (found,) = e.value.findings
    line = path.read_text().splitlines()[found.place.line - 1]
    named = words.partition(":")[0] if code == "wrong_type" else found.what.split("'plan': ")[-1].partition(" ")[0]
    assert (found.place.line, found.code) == (6, code)
    assert line[: found.place.column - 1].endswith(f"{named}: ")
    assert words in found.what


def test_a_quantity_for_a_port(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(lifted(PLAN, "40 mm"))
    lift = next(n for n in load_mission(path).spec.walk() if n.skill == "lift")
    assert lift.constants == {"grip_m": pytest.approx(0.04)}
    path.write_text(lifted(PLAN, "40 N"))
    with pytest.raises(MissionFaults, match="grip_m is in m, not 'N'"):
        load_mission(path)


@pytest.mark.parametrize("target", ["aple", "Apple", "gone.stl", "$name"])
def test_an_object_that_is_not_there_is_found_where_a_skill_names_it(target: str, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(
        HEAD + f"parameters: {{name: {{type: str, default: apfel}}}}\ntree:\n  - match: {{target: {target}}}\n"
    )
    with pytest.raises(MissionFaults) as e:
        load_mission(path)
    (found,) = e.value.findings
    assert (found.place.line, found.place.column) == (5, 21)
    assert found.code == ("unusable_stl" if "." in target else "no_such_stl")
