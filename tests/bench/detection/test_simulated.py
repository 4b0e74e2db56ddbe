"""The whole study, small, on the real simulation and the real prober."""

import csv
import json

import pytest

from glotouch_bt.bench.detection import DetectionStudy, run_study, table


@pytest.mark.study
def test_a_small_study_writes_its_folder(tmp_path):
    study = DetectionStudy(
        conditions=("nominal",),
        seeds=(3, 4),
        hours=0.002,
        minutes=0.25,
        pushes=4,
        robots=1,
        backend="mujoco",
        out=tmp_path / "study",
    )
    lines = []
    summary = run_study(study, lines.append)
    assert summary == json.loads((study.out / "summary.json").read_text())
    simulated = summary["conditions"]["nominal"]["simulated"]
    assert simulated["false_contacts_per_hour"]["count"] == 0
    assert simulated["false_contacts_per_hour"]["hours"] >= 0.25 / 60
    assert simulated["found_0.6N"]["rate"] == 1.0
    assert simulated["found_0.6N"]["n"] == 4
    rows = list(csv.DictReader((study.out / "trials.csv").read_text().splitlines()))
    assert {r["part"] for r in rows} == {"free", "pushed", "false_alarms", "uncompensated", "found"}
    assert (study.out / "detection.png").read_bytes().startswith(b"\x89PNG")
    assert lines
    assert any("0 false contacts" in line for line in table(summary))
