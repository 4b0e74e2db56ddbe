"""Simplification: fewer triangles, still closed, with the same surface."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco.hulls.simplify import MAX_FACES, simplified
from glotouch_bt.robot.scene.meshes import Mesh


def as_mesh(solid: trimesh.Trimesh) -> Mesh:
    v, f = np.array(solid.vertices), np.array(solid.faces)
    return Mesh("solid", v, f, hashlib.sha256(v.tobytes()).hexdigest())


def test_a_small_mesh_is_unchanged() -> None:
    mesh = as_mesh(trimesh.creation.icosphere(4, 0.03))
    vertices, faces = simplified(mesh)
    assert vertices is mesh.vertices_m or np.array_equal(vertices, mesh.vertices_m)
    assert np.array_equal(faces, mesh.faces)


def test_a_large_mesh_is_simplified_and_keeps_its_shape() -> None:
    mesh = as_mesh(trimesh.creation.torus(0.03, 0.012, major_sections=320, minor_sections=160))
    vertices, faces = simplified(mesh)
    solid = trimesh.Trimesh(vertices, faces, process=False)
    assert 0.3 * MAX_FACES < len(faces) <= MAX_FACES
    assert solid.is_watertight
    assert solid.volume == pytest.approx(2 * np.pi**2 * 0.03 * 0.012**2, rel=0.01)  # Pappus
    used = vertices[np.unique(faces)]
    ring = np.hypot(np.linalg.norm(used[:, :2], axis=1) - 0.03, used[:, 2])
    assert np.abs(ring - 0.012).max() < 1e-4
