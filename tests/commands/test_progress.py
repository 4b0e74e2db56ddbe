"""Progress of `glotouch run`: three live lines on a terminal, one line for each skill elsewhere."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rich.console import Console

from glotouch_bt.commands.terminal import RunProgress
from glotouch_bt.commands.terminal.progress import usual_duration_s
from glotouch_bt.mission import load_mission
from glotouch_bt.mission.record import NullRecord, RunSummary


@pytest.fixture
def summary() -> RunSummary:
    made = RunSummary(NullRecord())
    made.node = "retrieve/find_objects/probe_objects/orbit_probe"
    made.event("contact", 1.0, {})
    made.event("next_probe", 2.0, {"probability": {0: 0.25, 3: 0.625}})
    return made


def test_the_lines_of_a_terminal(summary: RunSummary, tmp_path: Path) -> None:
    progress = RunProgress(quiet=False)
    progress.start(load_mission("retrieve", {"target": "apple"}), tmp_path / "run")
    progress._parts = {"retrieve/find_objects": "find_objects"}
    progress._usual_s = 200.0
    console = Console(width=100)
    with console.capture() as shown:
        console.print(progress._lines(100.0, 20.0, summary))
        summary.event("paused", 3.0, {})
        console.print(progress._lines(100.0, 20.0, summary))
    text = shown.get()
    for said in (
        "running find_objects › orbit_probe",
        "contacts 1   objects 0 of 5   candidate 3: 62 %",
        "robot 1:40   wall 0:20 (5x)   about 0:20 left   p pauses",
        "PAUSED  find_objects › orbit_probe",
        "p goes on",
    ):
        assert said in text, said


def test_elsewhere_a_skill_is_one_line(summary: RunSummary, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with RunProgress(quiet=False) as progress:
        progress.start(load_mission("retrieve", {"target": "apple"}), tmp_path / "run")
        for t in (1.0, 1.5):
            progress.update(t, summary)
        summary.node = "retrieve/take_target/grasp"
        progress.update(2.0, summary)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[4] for line in lines[1:]] == ["orbit_probe", "grasp"]
    with RunProgress(quiet=True) as progress:
        progress.start(load_mission("retrieve", {"target": "apple"}), tmp_path / "run")
        progress.update(1.0, summary)
    assert capsys.readouterr().err == ""


def test_the_expected_rest_is_that_of_earlier_successful_runs(tmp_path: Path) -> None:
    for i, (mission, status, seconds) in enumerate(
        [
            ("a", "success", 10.0),
            ("a", "success", 30.0),
            ("a", "success", 20.0),
            ("a", "failure", 1.0),
            ("b", "success", 5.0),
        ]
    ):
        (tmp_path / str(i)).mkdir()
        result = {"mission": mission, "status": status, "sim_time_s": seconds}
        (tmp_path / str(i) / "result.json").write_text(json.dumps(result))
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "result.json").write_text("{")
    assert usual_duration_s(tmp_path / "new", "a") == 20.0
    assert usual_duration_s(tmp_path / "new", "c") is None
