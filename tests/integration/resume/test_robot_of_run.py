"""A run of the second arm: its folder states the robot, resume refuses another one, and replay needs no file."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.robot import BadInput
from glotouch_bt.runs import RunRequest, launch, resume
from glotouch_bt.runs.replay import replay


def test_a_run_keeps_its_robot(tmp_path: Path) -> None:
    for suffix in (".yaml", ".urdf"):
        shutil.copy(shipped_robots()["iiwa14"].with_suffix(suffix), tmp_path / f"iiwa14{suffix}")
    mine, folder = tmp_path / "iiwa14.yaml", tmp_path / "run"
    done = launch(RunRequest("calibrate", settings={"robot": str(mine)}, out=folder, report=False))
    assert done.status == "success"
    name = load_robot(str(mine)).name
    assert done.result["robot"] == name
    assert name in (folder / "mission.yaml").read_text()

    with pytest.raises(BadInput, match=r"give them again.*--set robot="):
        resume(folder, start="tool_calibrate")
    with pytest.raises(BadInput, match=r"this run was made with the robot 'KUKA.*this is 'Flexiv"):
        resume(folder, start="tool_calibrate", settings={"robot": "rizon4"})
    urdf = mine.with_suffix(".urdf")
    numbers = urdf.read_text()
    urdf.write_text(numbers.replace('effort="320"', 'effort="300"'))
    with pytest.raises(BadInput, match="its files have changed since"):
        resume(folder, start="tool_calibrate", settings={"robot": str(mine)})
    urdf.write_text(numbers)
    assert resume(folder, start="tool_calibrate", settings={"robot": str(mine)}, report=False).status == "success"

    for path in (mine, urdf):
        path.unlink()
    assert replay(folder).same
