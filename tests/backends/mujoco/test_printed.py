"""Shapes of printed objects against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco.printed import Roughness, lean_feet, offset_vertices, printed_hull, printed_mesh
from glotouch_bt.robot.scene import Mesh

BOX_M = (0.04, 0.06, 0.08)


def mesh_of(solid: trimesh.Trimesh) -> Mesh:
    vertices = np.array(solid.vertices)
    vertices[:, 2] -= vertices[:, 2].min()
    return Mesh("solid", vertices, np.array(solid.faces, dtype=np.int64), "digest")


def test_each_plane_of_a_box_moves_by_the_offset() -> None:
    mesh = mesh_of(trimesh.creation.box(BOX_M))
    found = printed_mesh(mesh, 1.02, 0.0003)
    np.testing.assert_allclose(found.extents_m, 1.02 * np.array(BOX_M) + 2 * 0.0003, atol=1e-12)
    assert found.vertices_m[:, 2].min() == pytest.approx(0.0, abs=1e-12)
    hull = printed_hull(np.array(mesh.vertices_m), 1.02, 0.0003)
    np.testing.assert_allclose(np.ptp(hull, axis=0), found.extents_m, atol=1e-12)


def test_a_sphere_grows_by_the_offset() -> None:
    sphere = trimesh.creation.icosphere(4, 0.03)
    found = offset_vertices(np.array(sphere.vertices), np.array(sphere.faces), 0.0005)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 0.0305, atol=2e-6)


def test_the_same_solid_is_left_alone() -> None:
    mesh = mesh_of(trimesh.creation.box(BOX_M))
    assert printed_mesh(mesh, 1.0, 0.0) is mesh


def test_feet_on_a_tilted_plane() -> None:
    """Rotated by the lean about the axis across its direction, all feet have the same height."""
    feet = np.array([[x, y, 0.0014] for x in (-0.02, 0.02) for y in (-0.03, 0.03)])
    lean, about = np.deg2rad(3.0), 0.7
    found = lean_feet(feet, lean, about)
    axis = np.array([-np.sin(about), np.cos(about), 0.0])
    turned = found @ trimesh.transformations.rotation_matrix(lean, axis)[:3, :3].T
    assert np.ptp(turned[:, 2]) < 1e-12
    assert found[:, 2].max() == 0.0014
    top = trimesh.transformations.rotation_matrix(lean, axis)[:3, 2]
    assert np.arctan2(top[1], top[0]) == pytest.approx(about)


def test_roughness_has_its_rms_and_length() -> None:
    """Noise filtered with sd s has the covariance exp(-r^2 / (4 s^2))."""
    rng = np.random.default_rng(3)
    field, points = Roughness(1e-4, rng), rng.uniform(0.0, 0.064, (20000, 3))
    here, there = field.at(points), field.at(points + np.array([0.002, 0.0, 0.0]))
    assert here.std() == pytest.approx(1e-4, rel=0.1)
    assert (here * there).mean() / (here * here).mean() == pytest.approx(np.exp(-0.25), abs=0.06)
