"""The model a mission is given, in the wrong size."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glotouch_bt.faults.models import wrong_models
from glotouch_bt.mission.load import load_mission
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene.meshes import load_mesh
from tests.faults.conftest import plan_of


def test_the_model_is_scaled_and_the_object_is_not(tmp_path: Path) -> None:
    mission = load_mission("retrieve", {"target": "train"})
    given = wrong_models(plan_of("  - {fault: wrong_scale_stl, with: {factor: 1.25}}"), mission, tmp_path / "models")
    real = load_mesh(mission.world.objects.folder / "train.stl")
    assert np.allclose(load_mesh(Path(given["target"])).extents_m, 1.25 * np.asarray(real.extents_m), rtol=1e-5)
    again = load_mission("retrieve", given)
    assert again.world.objects.folder == mission.world.objects.folder
    assert Path(str(again.parameters["target"])).stem == "train"


def test_a_plan_without_one_gives_nothing(tmp_path: Path) -> None:
    mission = load_mission("retrieve")
    assert wrong_models(plan_of("  - {fault: wrench_off}"), mission, tmp_path / "models") == {}
    assert not (tmp_path / "models").exists()


def test_a_mission_without_an_object(tmp_path: Path) -> None:
    mission = replace(load_mission("calibrate"), stl_parameters=())
    with pytest.raises(BadInput, match="no parameter of type stl"):
        wrong_models(plan_of("  - {fault: wrong_scale_stl}"), mission, tmp_path)
