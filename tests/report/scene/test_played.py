"""The data of the report's scene against the run it is made of."""

from __future__ import annotations

import base64
import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glotouch_bt.report import read_run
from glotouch_bt.report.scene import played, scene_data, scene_json
from glotouch_bt.report.state import read_setup


@pytest.fixture(scope="module")
def data(whole: SimpleNamespace) -> dict[str, Any]:
    record = read_run(whole.folder)
    found = scene_data(record, read_setup(record))
    assert found is not None
    return json.loads(scene_json(found))


def numbers(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_the_arm_moves_as_recorded(data: dict[str, Any], whole: SimpleNamespace) -> None:
    record = read_run(whole.folder)
    q = numbers(data["motion"]["q"], "<i2").reshape(-1, 7) * played.JOINT_RAD
    at = data["start"] + np.arange(len(q)) / data["rate"]
    recorded = np.array([np.interp(at, record.samples["stamp_s"], record.samples["q"][:, i]) for i in range(7)]).T
    np.testing.assert_allclose(q[1:-1], recorded[1:-1], atol=0.01)  # at most a control period late
    peak = numbers(data["motion"]["force"], "<u2").max() * played.FORCE_N
    assert peak == pytest.approx(np.linalg.norm(record.samples["force_S_N"], axis=1).max(), abs=0.1)


def test_it_knows_at_each_time_what_was_known_then(data: dict[str, Any], whole: SimpleNamespace) -> None:
    assert len(data["touches"]) == len(whole.contacts)
    first, last = data["keys"][0], data["keys"][-1]
    assert first["outlines"] == []
    assert sorted(data["outlines"][i]["i"] for i in last["outlines"]) == [c.index for c in whole.candidates]
    assert last["felt"] == len(data["felt"]) > 0
    held = {k["tip"] for k in data["keys"]}
    assert held == {None, data["probe"]}
    assert [k["t"] for k in data["keys"]] == sorted(k["t"] for k in data["keys"])


def test_names_cannot_end_the_data() -> None:
    assert "</script" not in scene_json({"name": "</script><b>"})
    assert json.loads(scene_json({"name": "</script><b>"})) == {"name": "</script><b>"}


def test_a_mesh_keeps_its_size_when_its_corners_are_merged() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(4, 0.03)
    coarse = played._coarse(np.array(ball.vertices), np.array(ball.faces))
    corners = numbers(coarse["v"], "<i2").reshape(-1, 3) * played.STEP_M
    faces = numbers(coarse["f"], "<u2").reshape(-1, 3)
    assert len(faces) < len(ball.faces)
    assert faces.max() < len(corners)
    np.testing.assert_allclose(np.ptp(corners, axis=0), 0.06, atol=0.002)
