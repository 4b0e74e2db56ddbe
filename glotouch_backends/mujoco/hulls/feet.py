"""Foot spheres: at most eight small spheres on the outline of an object's base.

A flat round base touches a plane in three or four contacts that change from step to step, and the object creeps by
0.2-0.3 mm/s under half the load that should move it. Spheres just below the base have permanent contacts (creep below
5 um/s). They touch the floor only, as they protrude sideways by their radius.
"""

from __future__ import annotations

import numpy as np
import scipy

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

FOOT_RADIUS_M = 0.0015
"""Radius of a foot. Source: ours."""
FOOT_PROTRUSION_M = 0.0001
"""Protrusion of the feet below the base; vertices within this height above the lowest one form the base. Source:
ours."""
MAX_FEET = 8
"""Largest number of feet. Source: ours."""


def foot_centres(mesh: Mesh) -> Array:
    """Return the centres (m, 3) of the foot spheres in the mesh frame, counter-clockwise seen from above.

    3 <= m <= 8, or none for an object that stands on a point or an edge: it rolls on its hulls.

    The feet are corners of the support polygon. While there are more than eight, the corner whose removal costs the
    least area is dropped (Visvalingam and Whyatt 1993), which keeps the toppling limit.
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
    """Return the corners (m, 2) of the convex outline; (0, 2) if it has no area."""
    try:
        return np.asarray(points[scipy.spatial.ConvexHull(points).vertices])
    except (scipy.spatial.QhullError, ValueError):
        return np.zeros((0, 2))
