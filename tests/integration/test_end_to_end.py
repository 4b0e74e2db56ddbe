"""Whole missions in MuJoCo from the command line's words to the run's folder. No display is needed."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from glotouch_bt.report import read_run
from glotouch_bt.robot import Limits
from glotouch_bt.runs import past_worlds
from glotouch_bt.runs.launch import RunRequest, RunResult, launch

SCHEMA = {
    "mission": str, "backend": str, "seed": int, "conditions": str, "status": str, "reasons": list,
    "reason_chain": list, "target": (str, type(None)), "retrieved": (str, type(None)), "correct": (bool, type(None)),
    "ranking": (dict, list, type(None)), "candidates": list, "contacts": int, "sim_time_s": float, "ticks": int,
    "calibration": (dict, type(None)), "probe_path_m": float, "peak_force_N": float, "parameters": dict,
    "versions": dict, "wall_time_s": float,
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory):
    """Hulls computed here stay here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


def check_result(done: RunResult) -> dict:
    """result.json: keys, types, finite numbers, sound in itself and alike on disk."""
    result = json.loads((done.folder / "result.json").read_text())
    assert result == json.loads(json.dumps(done.result))
    for key, kind in SCHEMA.items():
        assert key in result
        assert isinstance(result[key], kind), (key, result[key])

    def finite(value: object) -> bool:
        if isinstance(value, dict):
            return all(finite(v) for v in value.values())
        if isinstance(value, list):
            return all(finite(v) for v in value)
        return not isinstance(value, float) or math.isfinite(value)

    assert finite(result)
    assert result["status"] in ("success", "failure", "aborted")
    assert result["sim_time_s"] == pytest.approx(0.01 * (result["ticks"] - 1), abs=0.011)
    assert len(result["reasons"]) == len(result["reason_chain"])
    for candidate in result["candidates"]:
        assert {"index", "contour", "height_m", "quality", "contacts"} <= set(candidate)
    return result


def check_folder(done: RunResult) -> None:
    files = {p.name for p in done.folder.iterdir()}
    assert {"mission.yaml", "run.mcap", "result.json", "report.html", "truth.json"} <= files
    assert not [f for f in files if f.startswith(".")], "nothing half-written"
    record = read_run(done.folder)
    assert record.complete
    assert record.result["status"] == done.result["status"]
    page = (done.folder / "report.html").read_text()
    assert page.rstrip().endswith("</html>")
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert not done.warning


def test_an_apple_is_retrieved(tmp_path: Path) -> None:
    """What `make demo` shows."""
    done = launch(RunRequest("retrieve", seed=0, settings={"target": "apple"}, out=tmp_path / "run"))
    result = check_result(done)
    assert (done.exit_code, result["status"], result["reasons"]) == (0, "success", []), result["reasons"]
    assert (result["target"], result["retrieved"], result["correct"]) == ("apple", "apple", True)
    assert 0.0 < result["peak_force_N"] < Limits().hard_force_N
    assert result["conditions"] == "nominal"
    with past_worlds(done.folder) as worlds:  # before the first tick, and after the last skill
        first, last = (worlds.objects(row) for row in (worlds.rows[0], worlds.rows[-1]))
    truth = json.loads((done.folder / "truth.json").read_text())
    assert [o["pose_B_O"] for o in first] == [o["pose_B_O"] for o in truth["start"]]
    for there, end in zip(last, truth["end"], strict=True):
        assert math.dist(there["pose_B_O"]["position_m"], end["pose_B_O"]["position_m"]) < 0.002
    assert len(result["candidates"]) == 5
    assert result["contacts"] > 20
    assert result["ranking"]
    check_folder(done)


@pytest.mark.parametrize(
    ("mission", "settings", "found"),
    [("calibrate", {}, 0), pytest.param("survey", {"expected_objects": "1"}, 1, marks=pytest.mark.study)],
)
def test_the_same_mission_twice_is_the_same_to_the_byte(
    mission: str, settings: dict[str, str], found: int, tmp_path: Path
) -> None:
    runs = [launch(RunRequest(mission, seed=3, settings=settings, out=tmp_path / name)) for name in ("one", "two")]
    first, second = (check_result(r) for r in runs)
    assert first["status"] == "success", first["reasons"]
    assert len(first["candidates"]) == found
    assert first["peak_force_N"] < Limits().hard_force_N
    for result in (first, second):
        for key in [k for k in result if k.startswith("wall_")]:
            del result[key]
    assert first == second
    assert str(tmp_path) not in json.dumps(first)
    records = [(r.folder / "run.mcap").read_bytes() for r in runs]
    assert records[0] == records[1]
    check_folder(runs[0])


@pytest.mark.parametrize("yaw_deg", [0, 40])
def test_what_stands_at_a_known_place_is_picked(block: Path, tmp_path: Path, yaw_deg: int) -> None:
    settings = {"x": "20", "y": "50", "yaw": str(yaw_deg), "width": "40"}
    settings["layout"] = json.dumps({"block": [0.02, 0.05, math.radians(yaw_deg)]})
    done = launch(RunRequest("pick_at", seed=1, settings=settings, objects=block, out=tmp_path / "run"))
    result = check_result(done)
    assert result["status"] == "success", result["reasons"]
    assert (result["retrieved"], result["correct"], result["target"]) == ("block", None, None)
    (thing,) = json.loads((done.folder / "truth.json").read_text())["end"]
    (before,) = json.loads((done.folder / "truth.json").read_text())["start"]
    lifted = thing["pose_B_O"]["position_m"][2] - before["pose_B_O"]["position_m"][2]
    assert lifted == pytest.approx(0.15, abs=0.01)
    check_folder(done)


def test_an_empty_place_is_a_failed_mission_with_its_reason(block: Path, tmp_path: Path) -> None:
    settings = {"x": "20", "y": "50", "layout": json.dumps({"block": [-0.05, -0.1, 0.0]})}
    done = launch(RunRequest("pick_at", settings=settings, objects=block, out=tmp_path / "run"))
    result = check_result(done)
    assert (done.exit_code, result["status"], result["retrieved"]) == (1, "failure", None)
    assert "no_grasp" in result["reasons"][-1]
    check_folder(done)


def test_ctrl_c_holds_the_arm_and_closes_the_record(tmp_path: Path) -> None:
    """A real process, a real signal, in the middle of a simulated survey."""
    words = [sys.executable, "-m", "glotouch_bt.cli", "run", "survey", "--seed", "0", "--out", "run"]
    folder = tmp_path / "run"
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        for _ in range(1200):
            if (folder / "run.mcap").exists() and (folder / "run.mcap").stat().st_size > 200_000:
                break
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=120)
    assert process.returncode == 130, stderr
    assert "stopped by the operator" in stderr
    assert "Traceback" not in stderr
    result = json.loads((folder / "result.json").read_text())
    assert result["status"] == "aborted"
    assert result["reason_chain"][-1]["code"] == "interrupted"
    assert result["sim_time_s"] > 1.0
    record = read_run(folder)
    assert record.complete
    assert record.result["status"] == "aborted"
    assert (folder / "report.html").stat().st_size > 10_000
