"""`bench pause` without physics: pairs of runs, their pauses, the summary, and what a user may get wrong."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from glotouch_bt.cli import app
from glotouch_bt.validation.pause import EveryNthTick, PauseStudy, run_pauses


@pytest.mark.study
def test_a_paused_mission_beside_its_twin(tmp_path: Path) -> None:
    told = []
    study = PauseStudy(
        mission="pick_at", seeds=(0, 1), every=20, pause_s=0.2, conditions="ideal", backend="fake", out=tmp_path
    )
    summary = run_pauses(study, lambda row, done, total: told.append((row["seed"], done, total)))
    assert told == [(0, 1, 2), (1, 2, 2)]
    assert summary["same"]["rate"] == 1.0
    assert summary["pauses"] > 4
    assert summary["hard_limit_broken"] == 0
    assert 0.0 < summary["longest_to_rest_s"] < 1.5
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
    with (tmp_path / "trials.csv").open() as f:
        rows = list(csv.DictReader(f))
    assert [r["seed"] for r in rows] == ["0", "1"]
    for row in summary["trials"]:
        assert row["status"] == row["twin_status"]
        assert row["paused_s"] <= 0.2 * row["pauses"] + 0.02 * row["pauses"]
        result = json.loads((tmp_path / f"paused-s{row['seed']}" / "result.json").read_text())
        assert result["paused_s"] == row["paused_s"]
        assert result["guards"] == {}


def test_pauses_come_at_every_nth_tick_however_long_they_are() -> None:
    control = EveryNthTick(10, 0.5)
    ticks, now_s, asked = 0, 0.0, []
    while ticks < 100:
        wanted = control.wants_pause(ticks, now_s)
        if wanted:
            asked.append(ticks)
        else:
            ticks += 1
        now_s += 0.01
    assert sorted(set(asked)) == list(range(10, 100, 10))
    assert len(asked) == pytest.approx(9 * 50, abs=9), "a period more where the clock rounds so"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--mission", "pick_it"], "did you mean"),
        (["--every", "0"], "--every"),
        (["--conditions", "nominl"], "did you mean"),
        (["--backend", "mujoko"], "did you mean"),
        (["--mission", "pick_at", "--set", "x=far"], "x"),
    ],
)
def test_bad_input_is_one_message(words: list[str], message: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["bench", "pause", *words, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output
    assert not (tmp_path / "out").exists()


@pytest.mark.study
def test_the_table_and_the_json(tmp_path: Path) -> None:
    words = ["bench", "pause", "--mission", "pick_at", "--backend", "fake", "--conditions", "ideal", "--trials", "1"]
    done = CliRunner().invoke(app, [*words, "--pause", "0.1", "--out", str(tmp_path / "a")])
    assert done.exit_code == 0, done.output
    assert "same end: 1 of 1" in done.output
    done = CliRunner().invoke(app, [*words, "--pause", "0.1", "--out", str(tmp_path / "b"), "--json"])
    assert done.exit_code == 0, done.output
