"""Timing of matching: every figure is there, and no trace of it is left in the user's cache."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glotouch_bt.bench.match.dataset import Layout, Touched
from glotouch_bt.bench.match.timing import time_matching
from glotouch_bt.perception.recognition import PadSpec
from glotouch_bt.robot.scene import load_folder
from tests.support.acquisition import NOMINAL, acquire


def a_ball(path: Path) -> None:
    import trimesh

    mesh = trimesh.creation.capsule(height=0.03, radius=0.025)
    mesh.export(path)


def test_figures_are_there_and_nothing_is_left(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "stl").mkdir()
    a_ball(tmp_path / "stl" / "ball.stl")
    (mesh,) = load_folder(tmp_path / "stl")
    touchset, pose = acquire(mesh, (0.0, 0.0, 0.0), NOMINAL, np.random.default_rng(0), pad=PadSpec())
    layout = Layout(0, "nominal", ("ball",), (Touched(touchset, "ball", pose, 0.0),))
    found = time_matching([layout], tmp_path / "stl", ["likelihood"])
    assert set(found["pair_ms"]) == {"likelihood"}
    assert found["pair_ms"]["likelihood"] > 0
    assert 0 < 1e-3 * found["load_stl_ms"] < found["new_stl_s"]
    assert not (tmp_path / "cache").exists()
    assert time_matching([], tmp_path / "stl", ["likelihood"]) == {}
