"""Convex parts as MuJoCo needs them: true hull vertices only, limited in number, none flat."""

from __future__ import annotations

import numpy as np
import scipy

from glotouch_bt.robot import Array

MIN_VOLUME_M3 = 1e-12
"""Drop parts below 0.001 mm3: they are residues of the cut, and MuJoCo refuses meshes without volume. Source: ours."""


def trimmed_hull(points: Array, max_vertices: int, tolerance_m: float) -> Array | None:
    """Return at most `max_vertices` of the hull's vertices, chosen so that the dropped ones protrude least.

    Greedy: start from four vertices far apart, and add those furthest outside the present hull until the count is
        reached
    or none protrudes by more than the tolerance. (CoACD's own decimation leaves gaps of millimetres.)

    Args:
        points: (n, 3), m.
        max_vertices: At least 4.
        tolerance_m: Largest protrusion of a dropped vertex.

    Returns:
        (k, 3) with 4 <= k <= max_vertices; None if the points span no volume.
    """
    try:
        hull = scipy.spatial.ConvexHull(points)
    except (scipy.spatial.QhullError, ValueError):
        return None
    if hull.volume < MIN_VOLUME_M3:
        return None
    vertices = np.asarray(points[hull.vertices], dtype=np.float64)
    chosen = _first_simplex(vertices)
    while len(chosen) < max_vertices:
        planes = _hull(vertices[chosen]).equations
        above = vertices @ planes[:, :3].T + planes[:, 3]
        above[chosen] = -np.inf
        # take the furthest point over every face at once, but none that protrudes much less than the worst
        candidates = np.unique(np.argmax(above, axis=0))
        outside = above[candidates].max(axis=1)
        order = np.argsort(-outside, kind="stable")
        bad = outside[order] > max(tolerance_m, 0.5 * float(outside[order[0]]))
        fresh = candidates[order[bad]][: max_vertices - len(chosen)]
        if not len(fresh):
            break
        chosen.extend(int(i) for i in fresh)
    return vertices[chosen]


def _hull(points: Array) -> scipy.spatial.ConvexHull:
    """Return the convex hull; joggle the points if coplanar ones defeat the exact algorithm."""
    try:
        return scipy.spatial.ConvexHull(points)
    except scipy.spatial.QhullError:
        return scipy.spatial.ConvexHull(points, qhull_options="QJ")


def _first_simplex(vertices: Array) -> list[int]:
    """Return the indices of four vertices far apart that span a volume."""
    first = int(np.argmax(np.linalg.norm(vertices - vertices.mean(axis=0), axis=1)))
    from_first = vertices - vertices[first]
    second = int(np.argmax(np.linalg.norm(from_first, axis=1)))
    axis = from_first[second] / np.linalg.norm(from_first[second])
    across = from_first - np.outer(from_first @ axis, axis)
    third = int(np.argmax(np.linalg.norm(across, axis=1)))
    normal = np.cross(axis, across[third])
    fourth = int(np.argmax(np.abs(from_first @ normal)))
    return [first, second, third, fourth]
