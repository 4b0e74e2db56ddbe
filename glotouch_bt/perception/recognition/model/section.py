"""Sections of a solid as the held probe feels it: the signed distance of the ball's centre from contact.

The ball's centre moves in the sensing plane. It touches where the ball, or the shaft above it, first meets the solid.
The plane's height above the solid's base is not exactly known: the floor is tilted, and the object leans.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.recognition.model.outline import SENSING_M, SHAFT_M, SHAFT_RADIUS_M, TIP_RADIUS_M
from glotouch_bt.perception.recognition.model.pads import Array32
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

CELL_M = 0.002
"""Edge of a cell of the table; interpolation errs by 0.05 mm on an edge that the ball of 6 mm goes round."""
MARGIN_M = 0.020
"""Distance by which the table extends beyond the solid."""
POINTS = 20_000
"""Number of points on the surface. They are 0.8 mm apart on an object of 60 mm, which errs by 0.02 mm."""
LEVELS_M = (SENSING_M, SENSING_M - 0.003, SENSING_M + 0.003)
"""Heights of the sensing plane above the solid's base, the nominal one first."""
MIN_SLOPE = 0.3
"""Least slope by which a distance in space is divided to get that in the plane."""
MAX_SLOPE = 2.0
"""Largest slope along an axis; the distance jumps where the nearest surface is another one."""
MIN_POINTS = 30
"""Least number of points beside the ball or the shaft for a solid to be felt."""


@dataclass(frozen=True, eq=False)
class TargetSection:
    """Tables of the distance of the ball's centre from contact, about a point of the solid.

    Attributes:
        table: (levels, n, n, 3) at each of `LEVELS_M`, x and y: the distance in the plane, m, negative where the ball
            would be inside, and its gradient.
    """

    table: Array32

    def at(self, points_m: Array, level: npt.NDArray[np.int64]) -> tuple[Array, Array]:
        """Return distances (s, k), m, and gradients (s, k, 2), by bilinear interpolation.

        Args:
            points_m: (s, k, 2) places of the ball's centre.
            level: (s,) indices of `LEVELS_M`.
        """
        n, flat = self.table.shape[1], self.table.reshape(-1, 3)
        at = np.clip(points_m / CELL_M + 0.5 * (n - 1), 0.0, n - 1 - 1e-6)
        whole = at.astype(np.int64)
        x, y = np.moveaxis(at - whole, -1, 0)[..., None]
        corner = (level[:, None] * n + whole[..., 0]) * n + whole[..., 1]
        near = flat[corner] * (1 - y) + flat[corner + 1] * y
        far = flat[corner + n] * (1 - y) + flat[corner + n + 1] * y
        found = near * (1 - x) + far * x
        return found[..., 0], found[..., 1:]


def section_of(mesh: Mesh, centre_m: Array) -> TargetSection | None:
    """Return the section of a solid about a point (2,) of its frame; None if it is too low to be felt."""
    points = _surface(mesh)
    points[:, :2] -= centre_m
    felt = np.abs(points[:, 2] - SENSING_M) < TIP_RADIUS_M
    if (felt | (points[:, 2] > SENSING_M)).sum() < MIN_POINTS:
        return None
    half = int(np.ceil((np.abs(points[:, :2]).max() + MARGIN_M) / CELL_M))
    grid = np.arange(-half, half + 1) * CELL_M
    x, y = np.meshgrid(grid, grid, indexing="ij")
    places = np.column_stack([x.ravel(), y.ravel()])
    tables = [_table(_distance(points - [0.0, 0.0, z], places).reshape(x.shape)) for z in LEVELS_M]
    table = np.array(tables, dtype=np.float32)
    table.setflags(write=False)
    return TargetSection(table)


def _distance(points: Array, places: Array) -> Array:
    """Return the distances (n,) in space between a probe at places (n, 2) and the surface's points (m, 3), whose z is
    that above the sensing plane."""
    ball, shaft = np.abs(points[:, 2]) < TIP_RADIUS_M, (points[:, 2] > 0.0) & (points[:, 2] < SHAFT_M)
    distance = np.full(len(places), MARGIN_M)
    if ball.any():
        centre = np.column_stack([places, np.zeros(len(places))])
        distance = np.minimum(distance, scipy.spatial.cKDTree(points[ball]).query(centre)[0] - TIP_RADIUS_M)
    if shaft.any():
        tree = scipy.spatial.cKDTree(points[shaft, :2])
        distance = np.minimum(distance, tree.query(places)[0] - SHAFT_RADIUS_M)
    return np.asarray(distance)


def _table(distance_m: Array) -> Array:
    """Return the table (n, n, 3) of distances (n, n) in space from the surface, which are positive inside as well."""
    label, _ = scipy.ndimage.label(distance_m > 0.0)
    outside = label == label[0, 0]
    depth = scipy.ndimage.distance_transform_edt(~outside) * CELL_M
    slope = _slope(distance_m)
    steep = np.maximum(np.linalg.norm(slope, axis=-1), MIN_SLOPE)
    planar = np.where(outside | (depth < TIP_RADIUS_M), distance_m / steep, 0.0)
    planar = np.clip(np.where(outside, planar, np.minimum(planar, CELL_M - depth)), -MARGIN_M, MARGIN_M)
    return np.concatenate([planar[..., None], _slope(planar)], axis=-1)


def _slope(values: Array) -> Array:
    """Return the gradient (n, n, 2) of values (n, n) at the cells."""
    along_x, along_y = (np.gradient(values, CELL_M, axis=axis) for axis in (0, 1))
    slope: Array = np.stack([along_x, along_y], axis=-1)
    return slope.clip(-MAX_SLOPE, MAX_SLOPE)


def _surface(mesh: Mesh) -> Array:
    """Return points (POINTS, 3) spread evenly over the surface, the same ones each time."""
    rng = np.random.default_rng(0)
    a, b, c = np.moveaxis(mesh.vertices_m[mesh.faces], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = np.searchsorted(np.cumsum(area) / area.sum(), (np.arange(POINTS) + rng.random(POINTS)) / POINTS)
    chosen = np.minimum(chosen, len(area) - 1)
    u, v = np.sqrt(rng.random(POINTS))[:, None], rng.random(POINTS)[:, None]
    return np.asarray((1 - u) * a[chosen] + u * (1 - v) * b[chosen] + u * v * c[chosen])
