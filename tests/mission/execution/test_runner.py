"""The tick loop: outcomes, reason chains, holding the arm, Ctrl-C, time."""

from __future__ import annotations

import os
import re
import signal
from typing import Any

import pytest

from glotouch_bt.mission.record.run_summary import NullRecord
from glotouch_bt.robot import BackendError, SafetyStop


class ListRecord(NullRecord):
    def __init__(self) -> None:
        self.ticks: list[tuple[float, list[tuple[str, str, str]]]] = []
        self.events: list[tuple[str, float, Any]] = []
        self.ports: list[tuple[float, str, object]] = []
        self.blocks = 0

    def block(self, observation: Any, command: Any) -> None:
        self.blocks += 1

    def tick(self, stamp_s: float, changes: Any) -> None:
        self.ticks.append((stamp_s, [(p, old.value, new.value) for p, old, new in changes]))

    def event(self, kind: str, stamp_s: float, data: Any) -> None:
        self.events.append((kind, stamp_s, data))

    def port(self, stamp_s: float, key: str, value: object) -> None:
        self.ports.append((stamp_s, key, value))


def test_success_is_recorded_tick_by_tick(go: Any, robot: Any) -> None:
    record = ListRecord()
    outcome = go("  - find: {how_many: 1}\n  - act: {script: RS}\n", record)
    assert outcome.status == "success"
    assert outcome.reasons == []
    assert robot.held == 1
    assert (outcome.ticks, record.blocks) == (3, 1 + 2), "what was there before the first command is a block too"
    assert outcome.end_s - outcome.start_s == pytest.approx(0.02)
    assert [k for k, *_ in record.events] == ["candidate"]
    assert record.events[0][2]["node"] == "find"
    assert {k for _, k, _ in record.ports} == {"items", "found", "complete"}
    assert record.ticks[0][1] == [
        ("m/sequence/find", "INVALID", "RUNNING"),
        ("m/sequence", "INVALID", "RUNNING"),
    ]
    assert record.ticks[1][1] == [
        ("m/sequence/find", "RUNNING", "SUCCESS"),
        ("m/sequence/act", "INVALID", "RUNNING"),
    ]
    assert len(record.ticks) == 3


def test_the_reason_chain_ends_with_the_root_cause(go: Any) -> None:
    tree = """
    - selector:
        name: explore
        do:
          - retry: {attempts: 2, do: {act: {script: RF, name: probe, code: no_touch}}}
          - act: {name: fallback, script: RF, code: lost}
"""
    outcome = go(tree)
    assert outcome.status == "failure"
    assert outcome.reasons == [
        "sequence: step 1 of 1, 'explore', failed",
        "explore: all 2 alternatives failed",
        "retry: failed 2 of 2 attempts",
        "probe: no_touch: probe was told to fail (change the script)",
    ]
    last = outcome.chain[-1].as_dict()
    assert (last["node"], last["code"], last["evidence"]) == ("probe", "no_touch", {"n": 1})


def test_a_condition_after_a_failure_keeps_the_skill_s_reason(go: Any) -> None:
    tree = "  - succeed: {sequence: [act: {script: F}, find]}\n  - condition: {port: found, at_least: 1}\n"
    outcome = go(tree)
    assert outcome.reasons[-1] == "found?: found is not set"


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (SafetyStop("force_N", 31.0, 30.0, 0.02), "safety_stop"),
        (BackendError("cable"), "backend_error"),
        (KeyboardInterrupt(), "interrupted"),
        (ValueError("bug"), "fault"),
    ],
)
def test_whatever_is_raised_the_arm_is_held(
    go: Any, robot: Any, error: BaseException, code: str, log: list[str]
) -> None:
    robot.fail_at = (0.02, error)
    outcome = go("  - find\n  - act: {script: RRRRRRRR}\n")
    assert outcome.status == "aborted"
    assert outcome.error is error
    assert outcome.chain[-1].as_dict()["code"] == code
    assert outcome.reasons[0].startswith("m/sequence/act: ")
    assert robot.held >= 1
    assert log[-1] == "act!", "the running skill was closed"


@pytest.mark.parametrize("script", ["X", "RX"])
def test_a_raising_skill_is_named(go: Any, robot: Any, script: str) -> None:
    outcome = go(f"  - act\n  - act: {{name: broken, script: {script}}}\n")
    assert isinstance(outcome.error, ZeroDivisionError)
    (reason,) = outcome.reasons
    assert re.fullmatch(r"m/sequence/broken: ZeroDivisionError: scripted \(conftest\.py:\d+; --debug .*\)", reason)
    assert robot.held == 1


def test_the_mission_s_time_is_the_robot_s(go: Any, robot: Any) -> None:
    outcome = go("  - act: {script: " + "R" * 50 + "}\n", timeout_s=0.2)
    assert outcome.status == "failure"
    assert outcome.chain[-1].as_dict()["code"] == "mission_timeout"
    assert outcome.end_s - outcome.start_s == pytest.approx(0.2)


def test_ctrl_c_takes_effect_between_cycles(go: Any, robot: Any) -> None:
    cycle = robot.cycle

    def pressed(command: object) -> Any:
        if robot.now_s >= 0.05:
            os.kill(os.getpid(), signal.SIGINT)
        return cycle(command)

    robot.cycle = pressed
    before = signal.getsignal(signal.SIGINT)
    record = ListRecord()
    outcome = go("  - act: {script: " + "R" * 500 + "}\n", record)
    assert isinstance(outcome.error, KeyboardInterrupt)
    assert record.blocks == 1 + 6, "what was there before; the cycle in which it was pressed is complete"
    assert robot.held == 1
    assert signal.getsignal(signal.SIGINT) is before


def test_progress_comes_twice_a_second_of_robot_time(go: Any) -> None:
    seen: list[float] = []
    go("  - act: {script: " + "R" * 200 + "}\n", on_progress=lambda t, summary: seen.append(t))
    assert seen == pytest.approx([0.0, 0.5, 1.0, 1.5])
