"""Every failure has a code, what was found against what was wanted, and what was sensed; the chain ends at the root."""

from __future__ import annotations

from typing import Any

import pytest

from glotouch_bt.mission.execution.runner import run_mission
from glotouch_bt.mission.nodes.base import ConditionSettings, failure_in_words
from glotouch_bt.mission.record.run_summary import NullRecord


@pytest.fixture
def fails(load: Any, robot: Any, no_arm: Any) -> Any:
    def run(tree: str) -> list[dict[str, Any]]:
        outcome = run_mission(load(tree), robot, NullRecord(), make_arm=no_arm)
        assert outcome.status == "failure"
        return [f.as_dict() for f in outcome.chain]

    return run


@pytest.mark.parametrize(
    ("tree", "codes", "evidence"),
    [
        ("  - act: {script: RF}\n", ["step_failed", "scripted"], {}),
        (
            "  - find: {how_many: 1}\n  - condition: {port: found, at_least: 4}\n",
            ["step_failed", "condition_false"],
            {"wanted": "found is at least 4", "found": 1},
        ),
        (
            "  - timeout: {seconds: 0.05, do: {act: {script: RRRRRRRRRRRRRRRRRRS}}}\n",
            ["step_failed", "timed_out"],
            {"limit_s": 0.05},
        ),
        (
            "  - retry: {attempts: 2, do: {act: {script: F}}}\n",
            ["step_failed", "retries_ran_out", "scripted"],
            {},
        ),
        (
            "  - selector:\n      - act: {script: F}\n      - act: {script: RF}\n",
            ["step_failed", "alternatives_failed", "scripted"],
            {},
        ),
    ],
)
def test_codes_along_the_chain(fails: Any, tree: str, codes: list[str], evidence: dict[str, Any]) -> None:
    chain = fails(tree)
    assert [f["code"] for f in chain] == codes
    assert evidence.items() <= chain[-1]["evidence"].items()
    assert all(f["message"] for f in chain)


@pytest.mark.parametrize(
    ("asked", "value", "said"),
    [
        ({"at_most": 3}, 5, "p is 5, not at most 3"),
        ({"at_least": 0.02}, 0.0125, "p is 0.0125, not at least 0.02"),
        ({"equals": True}, False, "p is false, not true"),
        ({"equals": "top"}, "outline", "p is 'outline', not 'top'"),
        ({"equals": 3}, object(), "p is another value, not 3"),
        ({"at_least": 1}, None, "p is not set"),
        ({"is_set": True}, None, "p is not set"),
        ({"is_set": False}, 2, "p is set"),
    ],
)
def test_a_condition_says_what_it_found_and_what_it_wanted(asked: dict[str, Any], value: object, said: str) -> None:
    assert failure_in_words(ConditionSettings(port="p", **asked), value) == said


def test_a_skill_s_failure_says_what_was_sensed(fails: Any) -> None:
    root = fails("  - act: {script: RRF}\n")[-1]
    assert set(root["sensed"]) == {"stamp_s", "force_N", "torque_Nm", "aperture_m", "x_B_m", "y_B_m", "z_B_m"}
    assert root["sensed"]["stamp_s"] == pytest.approx(0.02)
    assert root["sensed"]["force_N"] == pytest.approx(3**0.5, abs=1e-4)


def test_what_failed_besides_is_named(fails: Any) -> None:
    tree = "  - selector:\n      - act: {name: one, script: F}\n      - act: {name: two, script: F}\n"
    _, choice, root = fails(tree)
    assert root["node"] == "one"
    assert len(choice["others"]) == 1
    assert choice["others"][0].startswith("two")
