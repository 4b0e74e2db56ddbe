"""Ambiguities of meshes under touch: the yaws of symmetry of one, and pairs of twins. Computed from surfaces alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

YAWS = 72
SYMMETRIC_M = 0.7e-3
"""Mean surface distance below which a rotated mesh counts as symmetric, m."""
TWIN_M = 1.5e-3
"""Mean surface distance below which two meshes count as twins, m. Source: ours; scale and surface of a printed part
differ from its STL by 0.5 mm, and pads and jaws add about as much."""

_surfaces: dict[str, tuple[Array, Any]] = {}
_symmetry: dict[str, Array] = {}
_twins: dict[tuple[str, str], bool] = {}


def symmetries_rad(mesh: Mesh) -> Array:
    """Return the yaws of symmetry about the mesh centre, in steps of 5 deg, 0 first."""
    if mesh.digest not in _symmetry:
        _symmetry[mesh.digest] = _symmetries(mesh)
    return _symmetry[mesh.digest]


def _symmetries(mesh: Mesh) -> Array:
    points, tree = _surface(mesh)
    spacing = float(np.mean(np.asarray(tree.query(points, k=2)[0])[:, 1]))
    gaps = _gaps_m(mesh, mesh)
    same = gaps < SYMMETRIC_M + 0.6 * spacing
    if not same.all():  # small rotations always match nearly: keep only local minima
        same &= (gaps <= np.roll(gaps, 1)) & (gaps <= np.roll(gaps, -1))
    same[0] = True
    return np.asarray(2 * math.pi * np.arange(YAWS)[same] / YAWS)


def twins(a: Mesh, b: Mesh) -> bool:
    """Return True if the surfaces of two standing meshes nearly agree at some yaw."""
    pair = min(a.digest, b.digest), max(a.digest, b.digest)
    if pair not in _twins:
        _twins[pair] = float(np.maximum(_gaps_m(a, b), np.roll(_gaps_m(b, a)[::-1], 1)).min()) < TWIN_M
    return _twins[pair]


def _gaps_m(a: Mesh, b: Mesh) -> Array:
    """Return the mean distance (YAWS,) of points of a, turned about the centroid, from the surface of b."""
    points, (_, tree) = _surface(a)[0], _surface(b)
    probe = points[::8]
    out = np.zeros(YAWS)
    for k, angle in enumerate(2 * math.pi * np.arange(YAWS) / YAWS):
        c, s = math.cos(angle), math.sin(angle)
        turned = probe.copy()
        turned[:, :2] = probe[:, :2] @ np.array([[c, s], [-s, c]])
        out[k] = np.mean(tree.query(turned)[0])
    return out


def _surface(mesh: Mesh) -> tuple[Array, Any]:
    """Return points (n, 3) of the surface about its centroid, the foot at z = 0, and their k-d tree."""
    if mesh.digest not in _surfaces:
        import trimesh
        from scipy.spatial import cKDTree

        solid = mesh.as_trimesh()
        points, _ = trimesh.sample.sample_surface_even(solid, 6000, seed=0)
        points = np.asarray(points, dtype=np.float64)
        points[:, :2] -= solid.centroid[:2]
        points[:, 2] -= solid.bounds[0, 2]
        _surfaces[mesh.digest] = points, cKDTree(points)
    return _surfaces[mesh.digest]
