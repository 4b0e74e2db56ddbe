"""Solids of the world that are made without trimesh are bit for bit those that trimesh makes."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco.model import handle_mesh
from glotouch_backends.mujoco.model.inertia import uniform_inertia
from glotouch_bt.mission.read import load_world
from glotouch_bt.robot.scene import Mesh, load_folder

MASS_KG = 0.2


@pytest.mark.parametrize("mesh", load_folder(load_world("container_five").objects.folder), ids=lambda m: m.name)
def test_inertia_of_an_object(mesh: Mesh) -> None:
    solid = mesh.as_trimesh()
    solid.density = MASS_KG / solid.volume
    centre, inertia = uniform_inertia(mesh, MASS_KG)
    assert np.array_equal(centre, solid.center_mass)
    assert np.array_equal(inertia, solid.moment_inertia)


def test_handle_of_the_probe() -> None:
    probe = load_world("container_five").probe
    made, box = handle_mesh(probe), trimesh.creation.box(probe.handle_m)
    assert np.array_equal(made.vertices_m, box.vertices)
    assert np.array_equal(made.faces, box.faces)
