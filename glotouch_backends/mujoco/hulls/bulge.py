"""Distance between the union of convex hulls and the solid that they represent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

SKIN_M = 0.001
"""Points deeper than this inside the solid lie in a gap between two hulls, not on the outer surface. Source: ours."""


def depth_inside_m(points: Array, hulls: Sequence[Array]) -> Array:
    """Return the depth (n,) of each point inside the nearest hull; negative outside: a lower bound of the gap."""
    depth = np.full(len(points), -np.inf)
    for hull in hulls:
        planes = scipy.spatial.ConvexHull(hull).equations
        np.maximum(depth, -(points @ planes[:, :3].T + planes[:, 3]).max(axis=1), out=depth)
    return depth


def surface_distance_m(points: Array, mesh: Mesh, samples: int = 200_000) -> Array:
    """Return the distance (n,) of points from the mesh: exact to the triangles next to the nearest of dense samples."""
    import trimesh

    solid = mesh.as_trimesh()
    near, triangle = trimesh.sample.sample_surface(solid, samples, seed=0)
    _, index = scipy.spatial.cKDTree(near).query(points, k=6)
    closest = trimesh.triangles.closest_point(
        solid.triangles[triangle[index].ravel()], np.repeat(points, index.shape[1], axis=0)
    )
    gap = np.linalg.norm(closest.reshape(*index.shape, 3) - points[:, None], axis=2)
    return np.asarray(gap.min(axis=1), dtype=np.float64)


def bulge_m(mesh: Mesh, hulls: Sequence[Array], samples: int = 20_000) -> Array:
    """Return how far the union of hulls protrudes from the solid, at points spread evenly over the union's surface.

    Args:
        mesh: The solid.
        hulls: (k_i, 3) vertices of each convex part, in the mesh frame.
        samples: Number of points, before those hidden inside another hull are dropped.

    Returns:
        (n,) distances from the true surface in m, n <= samples; 0 where the union lies within the solid (to measure how
        far it falls short, use `depth_inside_m` of points on the true surface).
    """
    import trimesh

    shells = [trimesh.convex.convex_hull(h) for h in hulls]
    area = np.array([s.area for s in shells])
    counts = np.maximum(1, np.rint(samples * area / area.sum())).astype(int)
    drawn = [
        trimesh.sample.sample_surface(s, n, seed=i)[0] for i, (s, n) in enumerate(zip(shells, counts, strict=True))
    ]
    points, owner = np.concatenate(drawn), np.repeat(np.arange(len(hulls)), counts)
    hidden = np.zeros(len(points), dtype=bool)
    for i, hull in enumerate(hulls):
        others = (owner != i) & ~hidden
        hidden[others] = depth_inside_m(points[others], [hull]) >= 1e-6
    found = points[~hidden]
    distance = surface_distance_m(found, mesh)
    inside = mesh.as_trimesh().contains(found)
    # drop common faces of adjacent hulls: they lie deep inside the solid
    skin = ~inside | (distance < SKIN_M)
    return np.asarray(np.where(inside, 0.0, distance)[skin], dtype=np.float64)
