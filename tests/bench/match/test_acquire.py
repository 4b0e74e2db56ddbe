"""Recorded runs become labelled layouts, and layouts become folders and come back."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.bench.match import acquire
from glotouch_bt.bench.match.acquire import acquire_layout, from_json, layout_of
from glotouch_bt.bench.match.dataset import Layout, layout_files, read_layout, write_layout
from glotouch_bt.mission.record.mcap_json import to_json
from glotouch_bt.perception.touch import Contour, TouchSet
from glotouch_bt.report.run_record import RecordedEvent, RunRecord
from glotouch_bt.robot import BadInput, Pose
from tests.bench.match.conftest import a_layout, touchset

POSE_B_K = Pose.planar((0.6, 0.1, -0.2), 0.3)


def true_object(name, x, y, yaw, tilt=0.0):
    lean = Pose(np.zeros(3), np.array([np.cos(0.5 * tilt), np.sin(0.5 * tilt), 0.0, 0.0]))
    return {"name": name, "pose_B_O": to_json(POSE_B_K @ Pose.planar((x, y, 0.0), yaw) @ lean)}


def a_record(touchsets, start, end, status="success", chain=()):
    record = RunRecord(Path("run.mcap"), run={"seed": 7, "container": {"pose_B_K": to_json(POSE_B_K)}})
    record.result = {"conditions": "harsh", "status": status, "reason_chain": list(chain), "sim_time_s": 500.0}
    record.truth = {"start": start, "end": end}
    record.events = [RecordedEvent(float(k), "touchset", {"touchset": to_json(t)}) for k, t in enumerate(touchsets)]
    return record


def test_labels_come_from_where_objects_stood_first_or_last():
    start = [true_object("a", 0.10, 0.0, 0.0), true_object("b", 0.0, 0.1, 0.5), true_object("c", -0.1, 0.0, 0.0)]
    end = [true_object("a", 0.15, 0.0, 0.2), true_object("b", 0.0, 0.1, 0.6, tilt=0.4), start[2]]
    felt = [touchset(0, 0.05, centre=(0.0, 0.124)), touchset(1, 0.05, centre=(0.11, 0.0))]
    felt += [touchset(2, 0.05, centre=(-0.1, 0.026))]
    layout = layout_of(a_record(felt, start, end))
    assert [t.name for t in layout.touched] == ["b", "a", None]
    assert layout.touched[1].pose_K_O == pytest.approx((0.15, 0.0, 0.2), abs=1e-8)
    assert layout.touched[0].tilt_rad == pytest.approx(0.4)
    assert layout.touched[2].pose_K_O is None
    assert (layout.objects, layout.seed, layout.conditions) == (("a", "b", "c"), 7, "harsh")
    assert (layout.ended, layout.of("a"), layout.of("c")) == ("success", (1,), ())


def test_the_last_word_on_a_candidate_counts_and_what_was_not_felt_does_not():
    start = [true_object("a", 0.0, 0.0, 0.0)]
    felt = [touchset(0, 0.05, layers=(1,)), touchset(0, 0.06, layers=(2,)), touchset(1, 0.05, stable=False)]
    layout = layout_of(a_record(felt, start, start, "failure", [{"code": None}, {"code": "not_found"}]))
    assert [len(t.touchset.layers) for t in layout.touched] == [2]
    assert layout.ended == "not_found"


def test_a_record_without_truth_cannot_be_labelled():
    record = a_record([], [], [])
    record.truth = None
    with pytest.raises(BadInput, match="no truth"):
        layout_of(record)


def same(a, b):
    return json.dumps(to_json(a)) == json.dumps(to_json(b))


def test_journaled_values_come_back():
    good = touchset(3, 0.05)
    pad = np.array([[1e-4, np.nan], [0.0, 2e-6]])
    layer = dataclasses.replace(good.sequences[0].layers[0], left_m=pad, aperture_m=float("nan"))
    good = TouchSet(good.candidate, (dataclasses.replace(good.sequences[0], layers=(layer,)),))
    back = from_json(TouchSet, json.loads(json.dumps(to_json(good))))
    assert same(back, good)
    np.testing.assert_array_equal(back.layers[0].left_m, pad)
    assert np.isnan(back.layers[0].aperture_m)
    assert isinstance(back.candidate.contour, Contour)
    assert back.candidate.contour.boundary_K_m.shape == (0, 2)
    assert back.candidate.contour.covariance.shape == (0, 0)


def test_a_layout_comes_back(tmp_path):
    layouts = [a_layout(seed=4, names=("small", None)), a_layout(seed=11)]
    for x in reversed(layouts):
        write_layout(tmp_path / "set", x)
    back = [read_layout(f) for f in layout_files(tmp_path / "set")]
    assert [x.seed for x in back] == [4, 11]
    assert all(same(a, b) for a, b in zip(back, layouts, strict=True))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 9}, "of version 9"),
        ({"candidates": [{}]}, "KeyError"),
        ({"objects": None}, "TypeError"),
        ({"seed": "x"}, "ValueError"),
    ],
)
def test_a_wrong_truth_is_refused(tmp_path, change, message):
    file = write_layout(tmp_path, a_layout())
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    with pytest.raises(BadInput, match=message):
        read_layout(file)


def test_files_of_another_candidate_or_none_are_refused(tmp_path):
    file = write_layout(tmp_path, a_layout())
    content = json.loads(file.read_text())
    content["candidates"][0]["index"] = 5
    file.write_text(json.dumps(content))
    with pytest.raises(BadInput, match="holds candidate 0, not 5"):
        read_layout(file)
    (tmp_path / "s0003-c0.npz").unlink()
    with pytest.raises(BadInput, match=r"s0003-c0\.npz"):
        read_layout(file)
    file.write_text("{")
    with pytest.raises(BadInput, match="not a layout's truth"):
        read_layout(file)
    with pytest.raises(BadInput, match="not a folder of recorded TouchSets"):
        layout_files(tmp_path / "gone")


def test_acquiring_runs_the_mission_and_writes_the_layout(tmp_path, monkeypatch):
    start = [true_object("a", 0.0, 0.0, 0.0)]
    monkeypatch.setattr(acquire, "launch_trial", lambda request: SimpleNamespace(folder=request))
    monkeypatch.setattr(acquire, "read_run", lambda folder: a_record([touchset(0, 0.05)], start, start))
    layout = acquire_layout("a request", tmp_path)
    assert isinstance(layout, Layout)
    assert same(read_layout(layout_files(tmp_path)[0]), layout)
