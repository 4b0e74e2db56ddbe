"""The verdicts and figures of `bench faults` on runs that are made up, and the seam failed call by call for real."""

from __future__ import annotations

import json
import os
import signal
import time
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from glotouch_bt.campaign import WorkerLost
from glotouch_bt.faults.effects.catalogue import CATALOGUE
from glotouch_bt.mission.checkpoint.store import CheckpointRow
from glotouch_bt.robot import BadInput, UnknownName
from glotouch_bt.robot.fake import FakeRobot
from glotouch_bt.runs.launch import RunRequest
from glotouch_bt.validation.faults import exhaustive as faults_exhaustive
from glotouch_bt.validation.faults import start as faults_start
from glotouch_bt.validation.faults import trial as faults_trial
from glotouch_bt.validation.faults.campaign import FaultCampaign, run_campaign
from glotouch_bt.validation.faults.cases import CASES, SKILLS, Case, chosen_cases
from glotouch_bt.validation.faults.exhaustive import Exhaustive, run_exhaustive
from glotouch_bt.validation.faults.trial import drawn_after_s, verdict

GOOD: dict[str, Any] = {
    "status": "success",
    "reasons": [],
    "reason_chain": [],
    "retrieved": "apple",
    "correct": True,
    "peak_force_N": 12.0,
    "sim_time_s": 100.0,
    "held_at_end": True,
}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, "recovered"),
        ({"peak_force_N": 30.01}, "unsafe"),
        ({"retrieved": "train", "correct": False}, "wrong"),
        ({"retrieved": None, "correct": False}, "wrong"),
        ({"status": "failure", "retrieved": None, "correct": False, "reasons": ["x"]}, "safely ended"),
        ({"status": "failure", "retrieved": "apple", "reasons": ["x"]}, "safely ended"),
        ({"status": "failure", "retrieved": "train", "correct": False, "reasons": ["x"]}, "wrong"),
        ({"status": "aborted", "retrieved": None, "correct": False, "reasons": ["x"]}, "safely ended"),
        ({"status": "aborted", "retrieved": None, "correct": False, "reasons": []}, "unsafe"),
        ({"status": "aborted", "retrieved": None, "correct": False, "reasons": ["x"], "held_at_end": False}, "unsafe"),
        ({"status": "traceback"}, "unsafe"),
        ({"status": "hang"}, "unsafe"),
    ],
)
def test_verdicts(change: dict[str, Any], expected: str) -> None:
    assert verdict(GOOD | change, 30.0) == expected


def test_enough_is_tried() -> None:
    everywhere = [c for c in CASES if c.skills == SKILLS]
    assert len(everywhere) >= 12
    assert len(SKILLS) == 8
    assert all(c.fault in CATALOGUE and set(c.skills) <= set(SKILLS) for c in CASES)
    assert all(c.plan(s, 1.0).faults[0].params is not None for c in CASES for s in c.skills)
    with pytest.raises(UnknownName, match="wrench_off"):
        chosen_cases(["wrench_of"])


def test_the_moment_is_the_seeds_alone() -> None:
    assert drawn_after_s(3, "a", "b", 10.0) == drawn_after_s(3, "a", "b", 10.0) != drawn_after_s(4, "a", "b", 10.0)
    assert all(0.0 <= drawn_after_s(s, "a", "b", 10.0) <= 8.0 for s in range(50))


class Here:
    """An executor that is this process."""

    def submit(self, call: Any, *given: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(call(*given))
        return future


def made_up(request: RunRequest, *other: Any) -> Any:
    """What a run might have given."""
    assert request.out is not None
    request.out.mkdir(parents=True, exist_ok=True)
    (request.out / "run.mcap").write_bytes(b"")
    assert request.faults is not None
    specs = request.faults.faults  # type: ignore[union-attr]
    if not specs:
        return GOOD | {"faults": []}
    if specs[0].kind.name == "exception" and specs[0].when.node == "lift":
        raise ZeroDivisionError("a bug")
    seen = {"by": "touch_next", "code": "off_zero", "text": "the wrist reads 3 N", "stamp_s": 2.0}
    fault = {
        "fault": specs[0].kind.name,
        "effective": specs[0].when.node != "grasp",
        "applied": 1,
        "samples_altered": 10,
        "commands_altered": 0,
        "commands_refused": 0,
        "acts": 0,
        "moved_m": 0.0,
        "seen": seen,
        "sightings": [seen],
        "latency_s": 0.5,
        "recovery": ["tare"],
    }
    ended = {"status": "failure", "retrieved": None, "correct": False, "reasons": ["touch_next: off_zero"]}
    ended["reason_chain"] = [{"node": "touch_next", "code": "off_zero", "message": "m", "advice": "a"}]
    return GOOD | (ended if specs[0].when.node == "touch_next" else {}) | {"faults": [fault]}


def test_a_campaign_counts_every_trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faults_trial, "_launched", made_up)
    monkeypatch.setattr(faults_trial, "durations", lambda folder: dict.fromkeys(("touch_next", "grasp", "lift"), 5.0))
    campaign = FaultCampaign(
        mission="retrieve",
        settings={},
        cases=chosen_cases(["wrench_bias", "exception"]),
        skills=("touch_next", "grasp", "lift", "touch_top"),
        seeds=(1, 2),
        conditions="nominal",
        objects=None,
        backend="mujoco",
        out=tmp_path / "c",
    )
    seen: list[tuple[int, int]] = []
    summary = run_campaign(campaign, Here(), lambda row, done, total: seen.append((done, total)))  # type: ignore[arg-type]
    assert summary["trials"] == 8  # 2 classes x touch_next and lift x 2 seeds; in grasp nothing was altered
    assert len(summary["altered_nothing"]) == 4
    assert summary["not_reached"] == 4
    assert summary["tracebacks"] == 2
    assert summary["verdicts"] == {"recovered": 2, "safely ended": 4, "wrong": 0, "unsafe": 2}
    assert summary["recovered"]["n"] == 4
    assert summary["recovered"]["rate"] == 0.5
    assert (summary["named"]["n"], summary["named"]["rate"]) == (6, 2 / 6)
    assert seen[-1][0] == 14
    assert (campaign.out / "matrix.png").stat().st_size > 1000
    assert json.loads((campaign.out / "summary.json").read_text())["classes"] == ["wrench_bias", "exception"]
    assert not (campaign.out / "wrench_bias-lift-s1" / "run.mcap").exists()

    def never(*given: Any) -> Any:
        raise AssertionError("it was there already")

    monkeypatch.setattr(faults_trial, "_launched", never)
    again = run_campaign(replace(campaign, resume=True), Here())  # type: ignore[arg-type]
    assert again == summary


def test_a_trial_that_hangs_or_loses_its_process_is_unsafe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def hangs(*_: object) -> Any:
        raise faults_trial.Hung

    monkeypatch.setattr(faults_trial, "_launched", hangs)
    request = RunRequest("m", out=tmp_path / "t", faults=Case("wrench_off").plan("lift", 0.0))
    labels = {"class": "wrench_off", "skill": "lift", "seed": 1}
    row = faults_trial.run_trial(request, labels, 30.0)
    assert (row["status"], row["verdict"]) == ("hang", "unsafe")
    lost = faults_trial.failed_trial(labels, WorkerLost(-9))
    assert (lost["status"], lost["verdict"], lost["cause"]) == (
        "lost", "unsafe", "lost: its process was killed (SIGKILL)"
    )  # fmt: skip


def short_mission(folder: Path) -> str:
    mission = folder / "short.yaml"
    mission.write_text("mission: short\nworld: worlds/container_five.yaml\ntree:\n  sequence:\n    - tool_pickup\n")
    return str(mission)


def test_every_call_of_a_short_mission_can_fail(tmp_path: Path) -> None:
    study = Exhaustive(short_mission(tmp_path), {}, "fake", 0, 60, tmp_path / "out")
    summary = run_exhaustive(study)
    assert summary["bad"] == []
    assert summary["unfaulted"] == "failure"  # nothing is in the fake robot's holder
    assert summary["tried"] == len(summary["kinds"]) * -(-summary["calls"] // 60)
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == summary


def test_a_device_in_the_world_is_not_forked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FakeRobot, "paced", True)
    with pytest.raises(BadInput, match="its clock is the wall's"):
        run_exhaustive(Exhaustive(short_mission(tmp_path), {}, "fake", 0, 60, tmp_path / "out"))


def test_a_run_that_does_not_end_as_it_must_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An arm that nobody holds, a process that dies, and one that hangs: at every call, and the parent goes on."""
    monkeypatch.setattr(faults_exhaustive, "HUNG_S", 1)

    def judge(injector: Any, outcome: Any, error: Any) -> str:
        name, call = injector.failing
        if call == 0:
            return "the arm was not held"
        if call == 300:
            os.kill(os.getpid(), signal.SIGKILL)
        while name == "exception":
            time.sleep(0.01)
        raise RuntimeError

    monkeypatch.setattr(faults_exhaustive, "_judged", judge)
    summary = run_exhaustive(Exhaustive(short_mission(tmp_path), {}, "fake", 0, 300, tmp_path / "out"))
    found = {(b["fault"], b["call"]): b["what"] for b in summary["bad"]}
    assert found["robot_fault", 0] == found["exception", 0] == "the arm was not held"
    assert found["robot_fault", 300] == "the process died of SIGKILL"
    assert found["robot_fault", 600] == "the process ended with code 1"
    assert found["exception", 600].startswith("hangs")


def test_a_trial_begins_at_the_last_checkpoint_before_the_first_run_of_its_skill() -> None:
    paths = [(), ("m/a",), ("m/b", "m/seq"), ("m/a",), ("m/b",)]
    rows = [CheckpointRow(i, 10.0 * i, "", "", begun, {}, None, True) for i, begun in enumerate(paths)]
    found = faults_start._first(rows, "b")
    assert found is not None
    path, before, index = found
    assert (path, before.number, index) == ("m/b", 1, 1)
    assert faults_start._first(rows, "seq") == ("m/seq", rows[1], 1)
    assert faults_start._first(rows, "c") is None
