"""Shape of a real object made from an STL: scaled, with its surface offset, rough, and standing on an uneven base.

All functions map geometry to geometry; `truth` draws the numbers.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

ROUGHNESS_LENGTH_M = 0.002
"""Correlation length (sd of the Gaussian filter) of the roughness. Source: ours, ten printed layers of 0.2 mm."""
GRID = 64
"""Points along an edge of the periodic noise."""
GRID_STEP_M = 0.001
"""Distance of two points of the noise, half its correlation length."""
MIN_PLANE_SHARE = 0.05
"""Smallest eigenvalue over the largest at which the planes at a vertex count as different. Source: ours."""


def offset_vertices(vertices_m: Array, faces: npt.NDArray[np.int64], offset_m: float) -> Array:
    """Return the vertices (v, 3) of the surface whose planes lie `offset_m` further out.

    Each vertex moves by the shortest d with n . d = offset for the normals n of its faces, by least squares weighted
    with the faces' angles at the vertex. Exact for planes, edges and corners of three planes.
    """
    corners = vertices_m[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    matrix, vector = np.zeros((len(vertices_m), 3, 3)), np.zeros((len(vertices_m), 3))
    for k in range(3):
        a = corners[:, (k + 1) % 3] - corners[:, k]
        b = corners[:, (k + 2) % 3] - corners[:, k]
        weight = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
        np.add.at(matrix, faces[:, k], weight[:, None, None] * normals[:, :, None] * normals[:, None, :])
        np.add.at(vector, faces[:, k], weight[:, None] * normals)
    inverse = np.linalg.pinv(matrix, rcond=MIN_PLANE_SHARE, hermitian=True)
    return np.asarray(vertices_m + offset_m * np.einsum("vij,vj->vi", inverse, vector))


def printed_mesh(mesh: Mesh, scale: float, offset_m: float) -> Mesh:
    """Return the true solid of an STL, resting on z = 0 again; the STL's own if nothing changes."""
    if scale == 1.0 and offset_m == 0.0:
        return mesh
    vertices = offset_vertices(scale * mesh.vertices_m, mesh.faces, offset_m)
    vertices[:, 2] += offset_m
    return replace(mesh, vertices_m=vertices, digest=f"{mesh.digest} x {scale!r} + {offset_m!r}")


def printed_hull(vertices_m: Array, scale: float, offset_m: float) -> Array:
    """Return a convex part (k, 3) of the STL changed like the solid."""
    if scale == 1.0 and offset_m == 0.0:
        return vertices_m
    points = np.asarray(scale * vertices_m)
    if offset_m != 0.0:
        hull = scipy.spatial.ConvexHull(points)
        faces = hull.simplices.astype(np.int64)
        corners = points[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inward = (normal * hull.equations[:, :3]).sum(axis=1) < 0.0
        faces[inward] = faces[inward][:, ::-1]
        points = offset_vertices(points, faces, offset_m)[hull.vertices]
    return np.asarray(points + np.array([0.0, 0.0, offset_m]))


def lean_feet(feet: Array, lean_rad: float, about_rad: float) -> Array:
    """Return foot centres (m, 3) lowered onto a plane through the lowest foot, so that the object leans.

    Args:
        feet: Centres of the feet of a flat base.
        lean_rad: Angle between the mesh's z axis and the vertical when the object stands on the feet.
        about_rad: Direction in the mesh frame in which the top leans.
    """
    if lean_rad == 0.0 or len(feet) == 0:
        return feet
    along = feet[:, :2] @ np.array([np.cos(about_rad), np.sin(about_rad)])
    lower = np.tan(lean_rad) * (along.max() - along)
    return np.asarray(feet - np.stack([np.zeros(len(feet)), np.zeros(len(feet)), lower], axis=1))


class Roughness:
    """A random field on a surface: Gaussian, of the correlation length above, periodic with 64 mm.

    Args:
        rms_m: Root mean square.
        rng: Source of the field.
    """

    def __init__(self, rms_m: float, rng: np.random.Generator) -> None:
        field = scipy.ndimage.gaussian_filter(
            rng.standard_normal((GRID, GRID, GRID)), ROUGHNESS_LENGTH_M / GRID_STEP_M, mode="wrap"
        )
        self._field: Array = rms_m * (field - field.mean()) / field.std()

    def at(self, points_m: Array) -> Array:
        """Return the heights (n,) above the smooth surface at points (n, 3) in the mesh frame."""
        where = (np.asarray(points_m) / GRID_STEP_M).T
        return np.asarray(scipy.ndimage.map_coordinates(self._field, where, order=1, mode="grid-wrap"))
