"""A simulation that can no longer be asked for the truth costs the score of a run, never its result."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

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


class TellingReferee(DyingReferee):
    """Answers always, and tells of an axis of the conditions without effect."""

    def __init__(self) -> None:
        super().__init__(10)

    def peak_force_N(self) -> float:
        return 0.0

    def samples_over_limit(self) -> int:
        return 0

    def contact_softness_s(self) -> float:
        return 0.004

    def tip_B_m(self) -> np.ndarray:
        return np.zeros(3)

    def silent_axes(self) -> tuple[str, ...]:
        return ("gel_blur_m",)


def backend_with(monkeypatch: pytest.MonkeyPatch, answers: int, referee: DyingReferee | None = None) -> None:
    backend = FakeBackend()
    referee = referee or DyingReferee(answers)
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


def test_an_axis_without_effect_is_an_error_after_the_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    backend_with(monkeypatch, 0, TellingReferee())
    with pytest.raises(BackendError, match=r"conditions gel_blur_m altered nothing in this run .* choose a larger"):
        launch(RunRequest("calibrate", "fake", conditions="ideal+gel_blur_m=1e-9", out=tmp_path / "run", report=False))
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["status"], result["conditions"]) == ("failure", "ideal+gel_blur_m=1e-9")
