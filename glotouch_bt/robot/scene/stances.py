"""The sides on which an object can stand, and a random one of them."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from functools import lru_cache

import numpy as np
import scipy

from glotouch_bt.compiled import compiled
from glotouch_bt.robot.geometry import Array, quat_to_matrix
from glotouch_bt.robot.scene.meshes import Mesh

Quat = tuple[float, float, float, float]
UPRIGHT: Quat = (1.0, 0.0, 0.0, 0.0)
"""Rotation of an object that stands as in its file."""
BASE_M = 0.0001
"""Vertices within this height above the floor carry an object. Source: the protrusion of the simulated feet."""
MIN_MARGIN_M = 0.002
"""Least distance of the centre of mass from the edge of the support polygon; on less an object rolls on. Source:
ours."""


def turned(mesh: Mesh, quat: Quat) -> Mesh:
    """Return the mesh rotated about its origin."""
    if quat == UPRIGHT:
        return mesh
    return replace(mesh, vertices_m=np.asarray(mesh.vertices_m @ quat_to_matrix(np.array(quat)).T))


def standing(mesh: Mesh, quat: Quat) -> Mesh:
    """Return the mesh as it stands when turned: lowest vertex at z = 0, middle of the bounding box at x = y = 0."""
    if quat == UPRIGHT:
        return mesh
    vertices = turned(mesh, quat).vertices_m
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    vertices = vertices - [*(0.5 * (low + high))[:2], low[2]]
    key = f"{mesh.digest} {' '.join(f'{q:.6f}' for q in quat)}"
    return replace(mesh, vertices_m=vertices, digest=hashlib.sha256(key.encode()).hexdigest())


def stances(mesh: Mesh) -> list[tuple[Quat, float]]:
    """Return the rotations onto stable sides, each with a number in proportion to its probability."""
    return list(zip(*_stances(ByDigest(mesh)), strict=True))


def draw_stance(mesh: Mesh, rng: np.random.Generator, lying_share: float | None = None) -> Quat:
    """Return the rotation onto a stable side, drawn with its probability; upright if there is none.

    Args:
        mesh: The object.
        rng: Source of the draws.
        lying_share: Probability of a side other than upright; None: that of the sides.
    """
    sides, shares = _stances(ByDigest(mesh))
    if lying_share is not None:
        if rng.random() >= lying_share:
            return UPRIGHT
        lying = [i for i, side in enumerate(sides) if side != UPRIGHT]
        sides, shares = tuple(sides[i] for i in lying), tuple(shares[i] for i in lying)
    number = rng.random()
    if not sides:
        return UPRIGHT
    return sides[min(int(np.searchsorted(np.cumsum(shares), number * sum(shares))), len(sides) - 1)]


class ByDigest:
    """A mesh as a key: two of the same geometry are equal."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ByDigest) and other.mesh.digest == self.mesh.digest

    def __hash__(self) -> int:
        return hash(self.mesh.digest)


@lru_cache(maxsize=64)
def _stances(key: ByDigest) -> tuple[tuple[Quat, ...], tuple[float, ...]]:
    """Return the rotations onto stable sides and the probability of each.

    A side is a plane on which the convex hull rests with its centre of mass above it, by a margin. Its probability is
    the solid angle of its faces seen from the centre of mass, over that of all sides (Boothroyd et al., "Natural
    resting aspects of parts", 1972, without the faces from which an object topples onto it).
    """
    mesh = key.mesh
    points, solid = mesh.vertices_m, mesh.as_trimesh()
    centre = np.asarray(solid.center_mass)
    hull = scipy.spatial.ConvexHull(points)
    normals, corners = hull.equations[:, :3], points[hull.vertices] - centre
    angles = _solid_angles(points[hull.simplices] - centre)
    along = np.linalg.svd(normals[:, None])[2][:, 1:]  # two axes in each plane
    heights = hull.equations[:, 3] + normals @ centre
    around = np.zeros(len(normals))
    _around(corners, np.ascontiguousarray(normals), heights, np.ascontiguousarray(along), around)
    sides: dict[bytes, tuple[Array, float]] = {}
    for i in np.flatnonzero(around >= MIN_MARGIN_M):
        base = np.flatnonzero(corners @ normals[i] + heights[i] >= -BASE_M)
        if _margin_m(corners[base] @ along[i].T) >= MIN_MARGIN_M:
            first, total = sides.get(base.tobytes(), (normals[i], 0.0))
            sides[base.tobytes()] = first, total + float(angles[i])
    return tuple(_onto_floor(normal) for normal, _ in sides.values()), tuple(total for _, total in sides.values())


@compiled("given f8[:, ::1]", "f8[:, ::1]", "f8[:]", "f8[:, :, ::1]", "f8[::1]")
def _around(corners: Array, normals: Array, heights: Array, along: Array, around: Array) -> None:
    """Fill the distances (n,) of the centre of mass from the edge of the bounding box of each support polygon.

    Args:
        corners: (m, 3) corners of the hull, from the centre of mass.
        normals, heights: (n, 3), (n,) the hull's planes: `normal . corner + height` is at most 0.
        along: (n, 2, 3) two axes in each plane.
        around: (n,) filled; negative if the centre is outside.
    """
    for i in range(len(normals)):
        low_u = low_v = np.inf
        high_u = high_v = -np.inf
        for j in range(len(corners)):
            x, y, z = corners[j, 0], corners[j, 1], corners[j, 2]
            if normals[i, 0] * x + normals[i, 1] * y + normals[i, 2] * z + heights[i] < -BASE_M:
                continue
            u = along[i, 0, 0] * x + along[i, 0, 1] * y + along[i, 0, 2] * z
            v = along[i, 1, 0] * x + along[i, 1, 1] * y + along[i, 1, 2] * z
            low_u, high_u = min(low_u, u), max(high_u, u)
            low_v, high_v = min(low_v, v), max(high_v, v)
        around[i] = min(min(-low_u, high_u), min(-low_v, high_v))


def _solid_angles(corners: Array) -> Array:
    """Return the solid angles (n,) of triangles (n, 3, 3) seen from the origin (Van Oosterom and Strackee 1983)."""
    a, b, c = (corners[:, i] for i in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return np.asarray(2.0 * np.abs(np.arctan2(np.abs((a * np.cross(b, c)).sum(1)), below)))


def _onto_floor(normal: Array) -> Quat:
    """Return the shortest rotation that turns an outward normal down."""
    x, y, z = normal.tolist()
    if z < -1.0 + 1e-9:
        return UPRIGHT
    if z > 1.0 - 1e-9:
        return (0.0, 1.0, 0.0, 0.0)
    quat = np.array([1.0 - z, -y, x, 0.0])  # 1 + normal . down, normal x down
    w, i, j, k = (quat / np.linalg.norm(quat)).tolist()
    return (w, i, j, k)


def _margin_m(base_m: Array) -> float:
    """Return the distance of the centre of mass from the edge of the support polygon.

    Args:
        base_m: Points (n, 2) in its plane, from the foot of the centre of mass.
    """
    try:
        hull = scipy.spatial.ConvexHull(base_m)
    except (scipy.spatial.QhullError, ValueError):
        return 0.0
    return float(-hull.equations[:, 2].max())
