"""The ring of small spheres an object stands on: at most eight, on the outline of its base.

A flat round base touches a plane in three or four contacts that change from step to step, and the object creeps by
0.2-0.3 mm/s under half the load that should move it; a few spheres just below the base keep the same contacts for ever
(creep below 5 um/s). Meant to touch the floor only: they stick out sideways by their radius.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

FOOT_RADIUS_M = 0.0015
FOOT_PROTRUSION_M = 0.0001
"""How far the spheres reach below the base. Vertices within the same height above the lowest one belong to the base."""
MAX_FEET = 8


def foot_centres(mesh: Mesh) -> Array:
    """Centres (m, 3) of the foot spheres in the mesh frame, counter-clockwise seen from above.

    3 <= m <= 8, or none where the object stands on a point or an edge: it rolls, and its hulls carry it.

    They stand on the corners of the support polygon; where it has more than eight, the corner whose removal costs the
    least area is dropped until eight are left (Visvalingam and Whyatt 1993), so that the object topples where it would.
    """
    base = mesh.vertices_m[mesh.vertices_m[:, 2] <= mesh.vertices_m[:, 2].min() + FOOT_PROTRUSION_M, :2]
    ring = _support_polygon(base)
    while len(ring) > MAX_FEET:
        before, after = np.roll(ring, 1, axis=0) - ring, np.roll(ring, -1, axis=0) - ring
        area = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
        ring = np.delete(ring, int(np.argmin(area)), axis=0)
    height = FOOT_RADIUS_M - FOOT_PROTRUSION_M
    return np.column_stack([ring, np.full(len(ring), height)])


def _support_polygon(points: Array) -> Array:
    """Corners (m, 2) of the convex outline; (0, 2) where it has no area."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return np.zeros((0, 2))
