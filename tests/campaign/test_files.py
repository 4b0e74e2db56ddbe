"""Functions shared by campaigns: trial requests and output files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from glotouch_bt.campaign import Campaign, TrialFolder, write_summary, write_table
from glotouch_bt.escaped_text import finite, json_text

NAN, INF = float("nan"), float("inf")


def test_a_trial_takes_the_settings_of_its_campaign(tmp_path: Path) -> None:
    campaign = Campaign(mission="m", seeds=(1, 2), out=tmp_path, settings={"a": "1"}, backend="fake")
    request = campaign.request(2, "x-s2", report=False)
    assert (request.mission, request.seed, request.backend) == ("m", 2, "fake")
    assert (request.out, request.settings, request.report) == (tmp_path / "x-s2", {"a": "1"}, False)
    assert campaign.request(1, "y", settings={"b": "2"}).settings == {"b": "2"}
    assert campaign.described() == {"mission": "m", "conditions": "nominal", "seeds": [1, 2]}


def test_files_hold_null_for_what_is_no_number(tmp_path: Path) -> None:
    write_table(tmp_path / "new", "trials.csv", ("a", "b"), [{"a": 1, "c": 2}, {"b": "x, y"}])
    assert (tmp_path / "new" / "trials.csv").read_bytes() == b'a,b\r\n1,\r\n,"x, y"\r\n'
    write_summary(tmp_path, {"mean": NAN, "all": [1.5, INF, {"low": -INF}], "n": 3})
    written = json.loads((tmp_path / "summary.json").read_text())
    assert written.pop("commit")
    assert written == {"mean": None, "all": [1.5, None, {"low": None}], "n": 3, "lost_attempts": 0}
    assert sorted(p.name for p in tmp_path.iterdir()) == [".claim", "new", "summary.json"]


def test_a_summary_counts_the_attempts_that_were_lost(tmp_path: Path) -> None:
    for name, causes in (("x/s1", ["killed"]), ("x/s2", ["killed", "hung"]), ("s3", [])):
        (tmp_path / name).mkdir(parents=True)
        TrialFolder(tmp_path / name).note_lost(causes)
    assert write_summary(tmp_path, {"n": 3})["lost_attempts"] == 3


def test_json_text_keeps_what_json_has() -> None:
    assert json.loads(json_text({"a": (1, 2.5, None, True), "b": "nan"})) == {"a": [1, 2.5, None, True], "b": "nan"}
    assert finite({"a": (NAN,)}) == {"a": [None]}
    with pytest.raises(TypeError):
        json_text({"a": Path("x")})
    assert json.loads(json_text({"a": Path("x")}, default=str)) == {"a": "x"}
