"""The choice of rendered moments, and what the report takes from film.json."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import pytest

from glotouch_bt.mission.checkpoint import CheckpointRow
from glotouch_bt.mission.record.recorder import Recorder
from glotouch_bt.report import write_report
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import write_film
from glotouch_bt.runs.film import MOMENTS, moments


def row(number: int, node: str) -> CheckpointRow:
    return CheckpointRow(number, 1.0 * number, f"m/{node}" if node else "", "SUCCESS", (), {}, None, True)


def test_a_moment_follows_the_last_skill_of_each_kind() -> None:
    rows = [row(0, ""), row(1, "sweep"), row(2, "probe"), row(3, "sweep 2")]
    assert [r.number for r in moments(rows)] == [2, 3]


def test_moments_of_a_long_mission_are_spread_over_it() -> None:
    chosen = [r.number for r in moments([row(i, "skill_" + chr(97 + i)) for i in range(1, 25)])]
    assert len(chosen) == MOMENTS
    assert (chosen[0], chosen[-1]) == (1, 24)


def test_a_run_without_checkpoints_has_no_film(tmp_path: Path) -> None:
    with pytest.raises(BadInput):
        write_film(tmp_path)


def test_the_report_shows_pictures_and_nothing_else_from_the_film(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", {}) as record:
        record.event("note", 1.0, {"text": "x"})
    picture = base64.b64encode(b"\xff\xd8\xff\xe0 a JPEG").decode()
    odd = [None, {}, {"jpeg": 3}, {"jpeg": '"><script>'}, {"jpeg": base64.b64encode(b"<svg>").decode()}]
    good = {"jpeg": picture, "node": "m/<lift>", "t_s": 3.25, "status": "FAILURE"}
    (tmp_path / "film.json").write_text(json.dumps([*odd, good]))
    page = write_report(tmp_path).read_text()
    assert page.count("<img") == page.count("data:") - 1 == 1  # the policy of the page names data: too
    assert "&lt;lift&gt; failed" in page
    assert "<script" not in page
