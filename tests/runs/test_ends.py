"""A simulation that cannot be asked for the truth, or a process that hangs, costs a run its score, not its result."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from glotouch_bt.report import read_run
from glotouch_bt.robot import BackendError, FakeRobot
from glotouch_bt.robot.fake import FakeBackend
from glotouch_bt.robot.simulation import TrueObject
from glotouch_bt.runs import RunRequest, launch


class DyingReferee:
    """Answers so many questions."""

    def __init__(self, answers: int) -> None:
        self.answers = answers

    def objects(self) -> list[TrueObject]:
        if not self.answers:
            raise BackendError("killed by SIGKILL")
        self.answers -= 1
        return []


def backend_with(monkeypatch: pytest.MonkeyPatch, answers: int) -> None:
    backend = FakeBackend()
    referee = DyingReferee(answers)
    monkeypatch.setattr(backend, "referee", lambda robot: referee, raising=False)
    monkeypatch.setitem(launch.__globals__, "load_backend", lambda name: backend)


def test_the_result_is_written_without_the_truth(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    backend_with(monkeypatch, 1)
    done = launch(RunRequest("calibrate", "fake", out=tmp_path / "run", report=False))
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert done.status == result["status"] == "failure", "the end of the mission stays what it was"
    assert "killed by SIGKILL" in result["unscored"]
    assert result["correct"] is None
    assert "go_on" not in result, "a failed mission is not resumed"
    assert not (tmp_path / "run" / "truth.json").exists()


def test_a_robot_that_cannot_start_its_run_is_closed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    closed: list[FakeRobot] = []
    monkeypatch.setattr(FakeRobot, "close", lambda self: closed.append(self))
    backend_with(monkeypatch, 0)
    with pytest.raises(BackendError, match="SIGKILL"):
        launch(RunRequest("calibrate", "fake", out=tmp_path / "run"))
    assert closed
    assert not (tmp_path / "run").exists()


HANGS = """
import signal
import sys
from pathlib import Path
from glotouch_bt.mission.execution.runner import run_mission
from glotouch_bt.mission.execution.watchdog import Watchdog
from glotouch_bt.robot import HOLD
from glotouch_bt.runs import RunRequest, launch
from glotouch_skills.tool.tool_pickup import ToolPickup


def run(self):
    yield HOLD
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    while True:
        sum(range(1000))


ToolPickup.run = run
run_mission.__kwdefaults__["stuck_s"] = 1.0
Watchdog.__init__.__kwdefaults__["grace_s"] = 0.5
launch(RunRequest("calibrate", "fake", out=Path(sys.argv[1])))
"""


def test_a_process_that_hangs_for_good_leaves_a_result_and_a_report(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    done = subprocess.run([sys.executable, "-c", HANGS, str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert f"glotouch resume {folder}" in done.stderr
    result = json.loads((folder / "result.json").read_text())
    assert (result["status"], result["go_on"]) == ("aborted", "glotouch resume RUN")
    assert result["reason_chain"][-1]["code"] == "skill_hung"
    assert "glotouch resume RUN" in (folder / "report.html").read_text()
    assert read_run(folder).complete
