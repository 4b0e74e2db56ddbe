"""A replay makes the same of the same data, and tells what another code, or a changed record, makes of it."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer

from glotouch_bt.commands.replay import replay as replay_command
from glotouch_bt.mission.execution.control import Control
from glotouch_bt.report import read_run
from glotouch_bt.report.run_record import RecordedEvent
from glotouch_bt.robot import HOLD, BadInput, Command, GripperTarget, JointSetpoint
from glotouch_bt.runs.launch import RunRequest, launch
from glotouch_bt.runs.replay.compare import compare_events, compare_ticks
from glotouch_bt.runs.replay.robot import RecordEnded
from glotouch_bt.runs.replay.run import replay, replayed_robot
from glotouch_bt.runs.replay.summary import as_lines
from glotouch_skills.tool.tool_calibrate import ToolCalibrate


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that feels the floor and two walls."""
    done = launch(RunRequest("calibrate", seed=3, out=tmp_path_factory.mktemp("run") / "calibrate"))
    assert done.outcome.status == "success"
    return done.folder


def test_the_same_code_finds_the_same(folder: Path) -> None:
    done = replay(folder)
    assert done.same
    assert done.divergence is None
    assert done.statuses == ("success", "success")
    assert done.compared["contact"] > 3
    assert max(v for v, _ in done.largest.values()) < 1e-12, "to the rounding of sums"


def test_other_code_is_seen(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    speed = ToolCalibrate.Params.model_fields["speed_m_s"]
    monkeypatch.setattr(speed, "default", 0.5 * speed.default)
    ToolCalibrate.Params.model_rebuild(force=True)
    try:
        done = replay(folder)
    finally:
        monkeypatch.undo()
        ToolCalibrate.Params.model_rebuild(force=True)
    assert not done.same
    assert done.divergence is not None
    record = read_run(folder)
    begun = next(t.stamp_s for t in record.ticks if t.node.endswith("tool_calibrate") and t.new == "RUNNING")
    assert done.divergence.stamp_s > begun, "up to there both did the same"
    assert all(d.stamp_s >= begun for d in done.differences)


def test_it_senses_what_the_record_holds(folder: Path) -> None:
    record = read_run(folder)
    robot = replayed_robot(record)
    seen = [robot.observe()]
    while robot.left:
        seen.append(robot.cycle(HOLD))
    np.testing.assert_array_equal(np.concatenate([o.stamp_s for o in seen]), record.samples["stamp_s"])
    np.testing.assert_array_equal(np.concatenate([o.q for o in seen]), record.samples["q"])
    assert [o.gripper.aperture_m for o in seen] == record.cycles["gripper_aperture_m"].tolist()
    assert robot.divergence is not None
    moved = np.flatnonzero(~np.isnan(record.cycles["command_q"][1:, 0]))[0] + 1
    jaws = np.flatnonzero(~np.isnan(record.cycles["command_aperture_m"][1:]))[0] + 1
    assert robot.divergence.cycle == min(moved, jaws), "holding is not what the robot was told from there on"
    with pytest.raises(RecordEnded, match="the record ends"):
        robot.cycle(Command())


def test_a_run_that_was_cut_off_is_replayed_to_its_end(folder: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut"
    shutil.copytree(folder, cut)
    whole = (folder / "run.mcap").read_bytes()
    (cut / "run.mcap").write_bytes(whole[: int(0.6 * len(whole))])
    (cut / "result.json").unlink()
    done = replay(cut)
    assert done.ended
    assert done.divergence is None
    assert done.statuses == ("unknown", "unknown")
    assert "the record is cut off or damaged at t=" in as_lines(done, 3)[1]
    assert replay(folder).cut_s is None
    late = read_run(cut).span_s[1] - 0.1
    assert all(d.stamp_s >= late for d in done.differences), "only what the cut took from the record's last moment"


def test_bad_input_is_said(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(BadInput, match="no run here"):
        replay(tmp_path)
    bare = tmp_path / "bare"
    shutil.copytree(folder, bare)
    (bare / "mission.yaml").unlink()
    with pytest.raises(BadInput, match=r"mission\.yaml is missing"):
        replay(bare)
    with pytest.raises(typer.Exit) as end:
        replay_command(tmp_path)
    assert end.value.exit_code == 2
    assert "no run here" in capsys.readouterr().err


def test_the_command_prints_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    replay_command(folder, json_=True)
    printed = json.loads(capsys.readouterr().out)
    assert printed["same"]
    assert printed["differences"] == []


def test_differences_are_named_by_their_path() -> None:
    then = [
        RecordedEvent(1.0, "contact", {"point": [0.1, 0.2], "node": "a"}),
        RecordedEvent(2.0, "contact", {"point": [0.0, 0.0]}),
    ]
    now = [
        RecordedEvent(1.0, "contact", {"point": [0.1, 0.3], "node": "a"}),
        RecordedEvent(2.0, "contact", {"point": [0.0, 1e-9]}),
    ]
    differences, compared, largest = compare_events(then, now, 1e-4)
    assert [(d.where, d.then, d.now) for d in differences] == [("1.point[1]", 0.2, 0.3)]
    assert compared == {"contact": 2}
    assert largest["contact"][0] == pytest.approx(0.1)
    missing, _, _ = compare_events(then, now[:1], 1.0)
    assert [(d.stamp_s, d.now) for d in missing] == [(2.0, None)]


def test_only_the_first_other_tick_is_told() -> None:
    then = [(0.0, "a", "RUNNING"), (0.1, "a", "SUCCESS"), (0.1, "b", "RUNNING")]
    now = [(0.0, "a", "RUNNING"), (0.1, "a", "FAILURE"), (0.1, "c", "RUNNING")]
    assert len(compare_ticks(then, now)) == 1
    assert compare_ticks(then, then) == []


class EveryNow(Control):
    """Asks for a pause of 0.3 s every second."""

    def wants_pause(self, ticks: int, now_s: float) -> bool:
        return now_s % 1.0 < 0.3


def test_a_paused_run_is_replayed_with_its_pauses(tmp_path: Path) -> None:
    done = launch(RunRequest("calibrate", seed=4, out=tmp_path / "paused"), control=EveryNow())
    assert done.outcome.status == "success"
    assert done.outcome.paused_s > 1.0
    again = replay(done.folder)
    assert again.divergence is None
    assert again.same


def test_gel_images_are_replayed_where_they_arrived(folder: Path) -> None:
    """The robot gives the recorded pixels in their cycle; a request that was or is not made is a divergence."""
    record = read_run(folder)
    robot = replayed_robot(record)
    stamps = record.cycles["stamp_s"]
    shape = (1, *robot.description.gripper.camera.shape, 3)  # type: ignore[union-attr]
    left, right = np.random.default_rng(0).integers(0, 256, (2, *shape)).astype(float)
    record.images = {"stamp_s": stamps[1:2], "arrived_s": stamps[3:4], "left": left, "right": right}
    robot = replayed_robot(record)
    seen = [robot.cycle(HOLD).images for _ in range(4)]
    assert [o is not None for o in seen] == [False, False, True, False]
    assert np.array_equal(seen[2].left, left[0])
    assert np.array_equal(seen[2].right, right[0])
    record.image_requests = {"stamp_s": stamps[1:2]}
    asked, silent = replayed_robot(record), replayed_robot(record)
    row = {name.removeprefix("command_"): column[1] for name, column in record.cycles.items()}
    motion = None
    if not np.isnan(row["q"][0]):
        motion = JointSetpoint(row["q"], row["dq"], np.zeros_like(row["q"]), robot.observe().pose_B_P)
    jaws = None
    if not np.isnan(row["aperture_m"]):
        jaws = GripperTarget(float(row["aperture_m"]), float(row["speed_m_s"]), float(row["force_N"]))
    first = Command(motion, jaws, tactile=bool(row["tactile"]), images=True)
    asked.cycle(first)
    silent.cycle(replace(first, images=False))
    assert asked.divergence is None
    assert silent.divergence is not None
    assert "gel images" in silent.divergence.what
    record.images["left"] = left[:, :-1]
    with pytest.raises(BadInput, match="gel image"):
        replayed_robot(record)
