"""All errors of a plan are reported at once, each with its place; nothing else ever happens."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel
from typer.testing import CliRunner

from glotouch_bt.cli import app
from glotouch_bt.faults import FaultInjector
from glotouch_bt.faults.effects.catalogue import CATALOGUE, CAUSE_PATTERNS
from glotouch_bt.faults.plan import check_plan, read_plan
from glotouch_bt.faults.trigger import Duration, Repeat, When
from glotouch_bt.mission.load import load_mission
from glotouch_bt.mission.read import limits_of
from glotouch_bt.mission.read.library import shipped
from glotouch_bt.mission.read.yaml_source import parse_yaml
from glotouch_bt.mission.spec.findings import MissionFaults
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.fake import FakeRobot
from tests.support.examples import examples

BAD = """\
faults: everything
sed: 3
plan:
  - fault: wrench_bais
  - fault: wrench_bias
    with: {force_N: [0, 0], torqe_Nm: [0, 0, 0]}
    when: {node: guarded_swep, time_s: 3 mm}
    for: eternity
  - fault: wrench_delay
    with: {delay_s: 9}
    for: node
  - fault: wrench_off
    for: {cycles: 3, until: ever}
    repeat: {times: 0}
  - 7
"""


def findings_of(text: str) -> list[tuple[int, int, str]]:
    with pytest.raises(MissionFaults) as e:
        check_plan(parse_yaml(text, "bad.yaml"))
    return [(f.place.line, f.place.column, f.code) for f in e.value.findings]


def test_all_faults_in_one_report_each_with_its_place() -> None:
    found = findings_of(BAD)
    assert [f[:1] + f[2:] for f in found] == [
        (2, "unknown_key"),
        (4, "unknown_fault"),
        (6, "wrong_type"),
        (6, "unknown_parameter"),
        (7, "wrong_unit"),
        (8, "wrong_type"),
        (10, "wrong_range"),
        (11, "wrong_value"),
        (13, "wrong_value"),
        (14, "wrong_range"),
        (15, "wrong_type"),
    ]
    with pytest.raises(MissionFaults, match=r"bad\.yaml:4:12: unknown fault 'wrench_bais'; did you mean 'wrench_bias'"):
        check_plan(parse_yaml(BAD, "bad.yaml"))


def test_a_node_nobody_has() -> None:
    mission = load_mission("calibrate")
    text = "faults: f\nplan:\n  - {fault: wrench_off, when: {node: tool_pickupp}}"
    with pytest.raises(MissionFaults, match="did you mean 'tool_pickup'"):
        check_plan(parse_yaml(text, "p.yaml"), mission.spec, mission.name)
    check_plan(parse_yaml(text.replace("pickupp", "pick*"), "p.yaml"), mission.spec, mission.name)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("for: 2 s", Duration(duration_s=2.0)),
        ("for: 250 ms", Duration(duration_s=0.25)),
        ("for: 3", Duration(duration_s=3.0)),
        ("for: ever", Duration(until="ever")),
        ("for: {cycles: 4}", Duration(cycles=4)),
        ("when: {node: x}", Duration(until="node")),
        ("name: x", Duration(until="ever")),
    ],
)
def test_how_long(text: str, expected: Duration) -> None:
    plan = check_plan(parse_yaml(f"faults: f\nplan:\n  - fault: wrench_off\n    {text}", "p.yaml"))
    assert plan.faults[0].duration == expected


def test_defaults_and_units() -> None:
    text = "faults: f\nseed: 4\nplan:\n  - {fault: wrench_off}\n  - {fault: wrench_off, when: {time_s: 1 min}}"
    plan = check_plan(parse_yaml(text, "p.yaml"))
    assert plan.seed == 4
    assert [f.name for f in plan.faults] == ["wrench_off", "wrench_off 2"]
    assert plan.faults[0].when == When()
    assert plan.faults[1].when.time_s == 60.0


@pytest.mark.parametrize("name", sorted(shipped("faults")))
def test_shipped_plans_fit_the_flagship(name: str) -> None:
    mission = load_mission("retrieve")
    assert read_plan(name, mission.spec, mission.name).faults


def test_the_catalogue_is_whole() -> None:
    for name, kind in CATALOGUE.items():
        assert kind.name == name
        assert kind.channel in CAUSE_PATTERNS
        kind.effect.Params()
        assert kind.as_dict()["parameters"] == kind.parameters()


def test_a_file_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such fault plan"):
        read_plan(tmp_path / "none.yaml")


leaf = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-5, 10**20),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(max_size=8),
    st.sampled_from([*CATALOGUE, "ever", "node", "2 s", "retrieve", "!!python/object:os.system", "a*", "[", "3 mm"]),
)
WORDS = "faults plan fault with when for repeat seed name times every_s cycles force_N share kind duration_s until lost"
keys = st.one_of(st.sampled_from([*WORDS.split(), *When.model_fields]), st.text(min_size=1, max_size=6))
tree = st.recursive(
    leaf, lambda t: st.one_of(st.lists(t, max_size=4), st.dictionaries(keys, t, max_size=5)), max_leaves=25
)


@settings(max_examples=examples(150, 400), deadline=None)
@given(
    st.one_of(
        tree,
        st.fixed_dictionaries(
            {"faults": st.just("f"), "plan": st.lists(st.dictionaries(keys, tree, max_size=5), max_size=4)}
        ),
    )
)
def test_no_plan_gives_anything_but_a_plan_or_its_faults(document: object) -> None:
    with suppress(BadInput):
        check_plan(parse_yaml(yaml.safe_dump(document, allow_unicode=True), "p.yaml"))


@pytest.mark.parametrize(
    ("text", "at", "message"),
    [
        ("when: {force_above_N: 10, force_below_N: 5}", (4, 31), "no force is above 10 N and below 5 N"),
        ("when: {aperture_above_m: 50 mm, aperture_below_m: 20 mm}", (4, 37), "above 0.05 m and below 0.02 m"),
        ("when: {visit: 3}", (4, 12), "visit needs a node"),
        ("when: {after_s: 2 s}", (4, 12), "after_s needs a node"),
        ("repeat: {times: 3, every_s: 1}", (4, 5), "for ever cannot repeat"),
        ("for: forever", (4, 10), "a time such as 2 s"),
    ],
)
def test_a_moment_that_never_comes_or_is_not_looked_at_is_refused(text: str, at: tuple[int, int], message: str) -> None:
    """Each was accepted: the fault never began, began at once, or came once instead of three times."""
    with pytest.raises(MissionFaults) as e:
        check_plan(parse_yaml(f"faults: f\nplan:\n  - fault: wrench_bias\n    {text}\n", "bad.yaml"))
    (found,) = e.value.findings
    assert (found.place.line, found.place.column) == at
    assert message in str(found)


def test_a_joint_that_the_arm_has_not_is_refused() -> None:
    plan = check_plan(parse_yaml("faults: f\nplan:\n  - {fault: following_error, with: {joint: 9}}\n", "bad.yaml"))
    with FakeRobot() as robot, pytest.raises(BadInput, match=r"bad\.yaml:3:5: .*joint 9: this arm has joints 0 to 6"):
        FaultInjector(robot, plan, 0)


def numbers_of(model: type[BaseModel]) -> list[tuple[str, list[str]]]:
    """Return (name, signs of the limits) of each parameter that is a number or a list of numbers."""
    fields = model.model_fields.items()
    return [(n, [sign[0] for sign, *_ in limits_of(f)]) for n, f in fields if re.search("int|float", str(f.annotation))]


@pytest.mark.parametrize("model", [When, Duration, Repeat, *(k.effect.Params for k in CATALOGUE.values())])
def test_every_number_of_a_plan_has_bounds(model: type[BaseModel]) -> None:
    assert [name for name, signs in numbers_of(model) if {">", "<"} - set(signs)] == []


@pytest.mark.parametrize(
    "fault", ["container_offset, with: {shift_m: [1e308, 0]}", "wrench_bias, with: {force_N: [0, 0, -1e308]}",
              "wrench_off, when: {time_s: 1e308}", "wrench_off, for: {cycles: 99999999999}"]
)  # fmt: skip
def test_huge_numbers_are_refused(fault: str) -> None:
    (found,) = findings_of(f"faults: f\nplan:\n  - {{fault: {fault}}}\n")
    assert found[0::2] == (3, "wrong_range")


@pytest.mark.parametrize("fault", ["exception", "robot_fault"])
def test_a_fault_at_the_first_call_is_an_error_of_the_robot(fault: str, tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_text(f"faults: f\nplan:\n  - {{fault: {fault}, when: {{call: 0}}}}\n")
    words = [
        "run",
        "calibrate",
        "--backend",
        "fake",
        "--faults",
        str(tmp_path / "f.yaml"),
        "--out",
        str(tmp_path / "o"),
    ]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 3, done.output
    assert "injected" in done.stderr
    assert "internal error" not in done.stderr
