"""Rays against solids with an analytic surface."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from glotouch_backends.mujoco.sensing.rays import SurfaceRays
from glotouch_bt.errors import ParamError
from glotouch_bt.robot.scene.meshes import Mesh


def solid(shape: trimesh.Trimesh) -> Mesh:
    return Mesh("shape", np.asarray(shape.vertices), np.asarray(shape.faces), digest="")


@pytest.mark.parametrize("seed", range(5))
def test_box_from_all_sides_to_a_tenth_of_a_micrometre(seed: int) -> None:
    """Slab method in float64; the box lies off the origin, where float32 is coarsest."""
    rng = np.random.default_rng(seed)
    half, centre = rng.uniform(0.02, 0.05, 3), rng.uniform(-0.1, 0.1, 3)
    box = trimesh.creation.box(2 * half)
    box.apply_translation(centre)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    target = centre + rng.uniform(-1.2, 1.2, (4000, 3)) * half
    origins = target - 0.2 * direction
    near, far = (centre - half - origins) / direction, (centre + half - origins) / direction
    enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
    clear = np.abs(leave - enter) > 1e-6  # a ray within float32 of an edge may go either way
    found = SurfaceRays(solid(box)).heights(origins, direction)
    hits = enter < leave
    assert (np.isfinite(found) == hits)[clear].all()
    both = clear & hits
    assert np.abs(found - enter)[both].max() < 1e-7


def test_sphere_within_its_tessellation() -> None:
    radius = 0.035
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=radius)
    sagitta = radius - np.linalg.norm(sphere.triangles_center, axis=1).min()
    side = np.linspace(-0.9 * radius, 0.9 * radius, 61)
    x, z = (a.ravel() for a in np.meshgrid(side, side))
    inside = x**2 + z**2 < (0.9 * radius) ** 2
    origins = np.stack([x, np.full(len(x), -0.1), z], axis=1)[inside]
    found = SurfaceRays(solid(sphere)).heights(origins, np.array([0.0, 1.0, 0.0]))
    true = 0.1 - np.sqrt(radius**2 - x[inside] ** 2 - z[inside] ** 2)
    slope = radius / np.sqrt(radius**2 - x[inside] ** 2 - z[inside] ** 2)  # a gap along the normal seen along the ray
    assert (found >= true - 1e-7).all()
    assert (found - true <= sagitta * slope + 1e-7).all()


def test_no_ray_passes_between_two_triangles() -> None:
    box = trimesh.creation.box((0.04, 0.04, 0.04)).subdivide().subdivide().subdivide()
    on_edges = box.vertices[box.edges_unique].mean(axis=1)
    front = on_edges[(on_edges[:, 1] < -0.0199) & (np.abs(on_edges[:, [0, 2]]).max(axis=1) < 0.0199)]
    assert len(front) > 50
    found = SurfaceRays(solid(box)).heights(front - [0.0, 0.05, 0.0], np.array([0.0, 1.0, 0.0]))
    assert np.abs(found - 0.05).max() < 1e-7


def test_a_ray_that_starts_inside_is_a_miss() -> None:
    rays = SurfaceRays(solid(trimesh.creation.box((0.04, 0.04, 0.04))))
    assert np.isinf(rays.heights(np.zeros((3, 3)), np.array([0.0, 1.0, 0.0]))).all()


def test_invalid_rays_are_refused() -> None:
    rays = SurfaceRays(solid(trimesh.creation.box((0.04, 0.04, 0.04))))
    with pytest.raises(ParamError, match="unit vector"):
        rays.heights(np.zeros((3, 3)), np.array([0.0, 2.0, 0.0]))
    with pytest.raises(ParamError, match=r"shape \(n, 3\)"):
        rays.heights(np.zeros(3), np.array([0.0, 1.0, 0.0]))
