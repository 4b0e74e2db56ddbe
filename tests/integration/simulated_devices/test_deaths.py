"""Whatever dies under a mission, its folder holds a result with cause and way on, a report, and a whole record."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from glotouch_backends.flexiv_xense.client import link, process
from glotouch_backends.flexiv_xense.client.process import DriverProcess
from glotouch_bt.mission.record import RunSummary
from glotouch_bt.report import read_run
from glotouch_bt.runs import RunRequest, find_resumable, installed_versions, launch

ROOT = Path(__file__).parents[3]


def require_told(folder: Path, cause: str) -> None:
    result = json.loads((folder / "result.json").read_text())
    assert result["status"] == "aborted"
    assert cause in result["reasons"][-1]
    assert result["go_on"] == "glotouch resume RUN"
    assert result["correct"] is None
    assert result["unscored"]
    assert not (folder / "truth.json").exists()
    report = (folder / "report.html").read_text()
    assert cause in report
    assert "glotouch resume RUN" in report
    record = read_run(folder)
    assert record.complete
    assert record.result["status"] == "aborted"
    find_resumable(folder, None, installed_versions()).file.close()


@pytest.mark.parametrize(
    ("victim", "number", "pace", "cause"),
    [
        ("_process", signal.SIGKILL, "lockstep", "the driver has ended: killed by SIGKILL"),
        ("_process", signal.SIGSTOP, "lockstep", "nothing heard from the driver"),
        ("_cell", signal.SIGKILL, "real", "the simulated cell does not answer"),
    ],
)
def test_a_device_that_dies_or_hangs_ends_the_run_with_a_result(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, victim: str, number: int, pace: str, cause: str
) -> None:
    started: list[DriverProcess] = []
    start = DriverProcess.start

    def noted(self: DriverProcess, trial: bytes) -> None:
        started.append(self)
        start(self, trial)

    def hit(robot_s: float, summary: RunSummary) -> None:
        if robot_s > 0.3:
            os.kill(getattr(started[0], victim).pid, number)

    monkeypatch.setattr(DriverProcess, "start", noted)
    monkeypatch.setattr(link, "LOCKSTEP_S", 1.0)
    monkeypatch.setattr(process, "END_S", 1.0)
    settings = {"devices": "simulated", "pace": pace}
    done = launch(RunRequest("calibrate", "flexiv_xense", settings=settings, out=tmp_path / "run"), on_progress=hit)
    assert done.exit_code == 3
    require_told(tmp_path / "run", cause)
    assert not started[0].folder.exists()


def test_an_executive_that_is_stopped_for_long_ends_the_run_with_a_result(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    words = ["run", "calibrate", "--backend", "flexiv_xense", "--set", "devices=simulated", "--out", str(folder)]
    command = [sys.executable, "-m", "glotouch_bt.cli", *words]
    executive = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with executive:
        for _ in range(1200):
            if (folder / "run.mcap").exists() and (folder / "run.mcap").stat().st_size > 100_000:
                break
            assert executive.poll() is None
            time.sleep(0.05)
        executive.send_signal(signal.SIGSTOP)
        time.sleep(11.0)
        executive.send_signal(signal.SIGCONT)
        _, said = executive.communicate(timeout=60.0)
    assert executive.returncode == 3, said
    assert f"glotouch resume {folder}" in said
    require_told(folder, "no word from the client for 1")
