"""The kill study on a house without physics: it counts what happened, and a resumed study keeps what it has."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from glotouch_bt.robot import BadInput
from glotouch_bt.validation.kill_resume import KillStudy, run_study, summarise
from tests.support.fake_cli import install_fakes

FAKE_CLI = Path(__file__).parents[2] / "support" / "fake_cli.py"
MISSION = """mission: m
world: container_five
tree:
  sequence:
    - wait: {name: first, seconds: 2.0}
    - wait: {name: second, seconds: 450.0}
    - wait: {name: last, seconds: 2.0}
"""


@pytest.mark.study
def test_a_killed_run_is_compared_with_its_twin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install_fakes(monkeypatch.setattr)
    (tmp_path / "m.yaml").write_text(MISSION)
    study = KillStudy(
        mission=str(tmp_path / "m.yaml"),
        seeds=[3],
        kills=1,
        out=tmp_path / "out",
        words=(sys.executable, str(FAKE_CLI)),
    )
    rows: list[dict[str, object]] = []
    summary = run_study(study, lambda row, done, total: rows.append(row))
    (row,) = rows
    assert row["outcome"] == "killed", "of a mission long enough that its processor time is no accident"
    assert row["exit_code"] == 0, row["message"]
    assert row["same_end"]
    assert row["same_result"]
    assert row["same_record"]
    assert row["skill_lost"] == 0
    assert summary["same_record"]["rate"] == 1.0
    assert summary["outside"] == 0
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == json.loads(json.dumps(summary))
    again = run_study(replace(study, resume=True, words=("false",)))
    assert again["same_record"] == summary["same_record"], "nothing was run again"
    with pytest.raises(BadInput, match="holds another campaign: conditions"):
        run_study(replace(study, resume=True, conditions="harsh"))


def test_a_moment_outside_the_mission_is_no_kill() -> None:
    inside = {"outcome": "killed", "same_end": True, "readable_after_kill": True, "readable_at_end": True}
    summary = summarise([inside, {"outcome": "not begun"}, {"outcome": "ended before"}])
    assert summary["outside"] == 2
    assert summary["same_end"]["n"] == 1
