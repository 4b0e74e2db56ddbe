"""`glotouch faults` and `run --faults` from the command line, on robots without physics."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from glotouch_bt.cli import app
from glotouch_bt.faults.effects.catalogue import CATALOGUE
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.robot import GlotouchError

runner = CliRunner()


def test_the_catalogue_as_json_and_as_a_table() -> None:
    listed = runner.invoke(app, ["faults", "--json"])
    assert listed.exit_code == 0
    assert [k["name"] for k in json.loads(listed.stdout)] == list(CATALOGUE)
    one = runner.invoke(app, ["faults", "wrench_delay"])
    assert one.exit_code == 0
    assert "delay_s" in one.stdout
    wrong = runner.invoke(app, ["faults", "wrench_dealy"])
    assert wrong.exit_code == 2
    assert "did you mean 'wrench_delay'" in wrong.stderr


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ("faults: f\nplan:\n  - {fault: wrench_of}\n", "did you mean 'wrench_off'"),
        ("faults: f\nplan:\n  - {fault: wrench_off, when: {node: tool_pickupp}}\n", "did you mean 'tool_pickup'"),
        ("faults: f\nplan:\n  - {fault: object_removed}\n", "needs a simulation backend"),
        ("faults: f\n", "needs 'plan'"),
        ("- 1\n", "must be a mapping"),
        ("faults: [", "not valid YAML"),
    ],
)
def test_a_bad_plan_is_one_message_and_nothing_is_left(tmp_path: Path, plan: str, message: str) -> None:
    file, out = tmp_path / "plan.yaml", tmp_path / "run"
    file.write_text(plan)
    ended = runner.invoke(app, ["run", "calibrate", "--backend", "fake", "--faults", str(file), "--out", str(out)])
    assert ended.exit_code == 2
    assert message in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not out.exists()


def test_a_faulted_run_says_what_became_of_its_faults(tmp_path: Path) -> None:
    file, out = tmp_path / "plan.yaml", tmp_path / "run"
    file.write_text("faults: f\nplan:\n  - {fault: exception, when: {node: tool_pickup, after_s: 0.2}}\n")
    ended = runner.invoke(app, ["run", "calibrate", "--backend", "fake", "--faults", str(file), "--out", str(out)])
    assert ended.exit_code == 3
    assert "injected exception" in ended.stderr
    result = json.loads((out / "result.json").read_text())
    (fault,) = result["faults"]
    assert result["status"] == "aborted"
    assert result["held_at_end"] is True
    assert result["reason_chain"][-1]["node"].endswith("tool_pickup")
    assert fault["effective"] is True
    assert fault["seen"]["code"] == "RuntimeError"
    assert "Injected faults" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--skill", "nobody"], "unknown skill that is broken here 'nobody'"),
        (["--skill", "graps"], "did you mean 'grasp'"),
        (["--fault", "touch_dead", "--skill", "grasp"], "no chosen fault acts there"),
    ],
)
def test_what_cannot_be_tried_is_said_before_anything_runs(words: list[str], said: str, tmp_path: Path) -> None:
    done = runner.invoke(app, ["bench", "faults", *words, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert said in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["faults", "resume"])
def test_a_mission_without_the_needed_parameters_is_named(name: str, tmp_path: Path) -> None:
    done = runner.invoke(app, ["bench", name, "--mission", "calibrate", "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "--mission calibrate: this experiment sets the parameters target, expected_objects" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_disk_that_refuses_the_record_hides_no_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    close, closed = Recorder.close, []

    def refused(self: Recorder, result: object = None) -> None:
        close(self, None)
        closed.append(self)
        if len(closed) == 1:
            raise GlotouchError("run.mcap: the record could not be finished (No space left on device)")

    monkeypatch.setattr(Recorder, "close", refused)
    out = tmp_path / "run"
    ended = runner.invoke(app, ["run", "calibrate", "--backend", "fake", "--out", str(out)])
    assert ended.exit_code == 3
    assert "could not be finished (No space" in ended.stderr
    reasons = json.loads((out / "result.json").read_text())["reasons"]
    assert reasons[-1] in ended.stdout, "result.json was written for all that, and says the same"


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("{fault: wrench_bias, with: {force_N: [1, 0, 0]}}", "fault wrench_bias: began once"),
        ("{fault: wrench_bias, when: {time_s: 9999}}", "NO EFFECT: its trigger never fired"),
        ("{fault: touch_dead, when: {time_s: 0.1}}", "NO EFFECT: it began but had nothing to change"),
    ],
)
def test_the_terminal_says_whether_a_fault_did_anything(tmp_path: Path, fault: str, words: str) -> None:
    file = tmp_path / "plan.yaml"
    file.write_text(f"faults: f\nplan:\n  - {fault}\n")
    told = ["run", "calibrate", "--backend", "fake", "--faults", str(file), "--out", str(tmp_path / "run")]
    assert words in runner.invoke(app, told).stdout
