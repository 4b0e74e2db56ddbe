"""Sections of a solid as the held probe feels it: the signed distance of the ball's centre from contact.

The ball's centre moves in the sensing plane. It touches where the ball, or the shaft above it, first meets the solid.
The plane's height above the solid's base is not exactly known: the floor is tilted, and the object leans.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.recognition.model.outline import SENSING_M, SHAFT_M, SHAFT_RADIUS_M, TIP_RADIUS_M
from glotouch_bt.perception.recognition.model.pads import Array32
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

Indices = npt.NDArray[np.int64]
TableAt = tuple[Indices, Indices]
"""For each pose (s,), the first cell and the width of the table in which it is looked up."""

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


@dataclass(frozen=True, eq=False)
class SectionTables:
    """Tables of several sections, joined so that one call looks up all hypotheses of a target.

    Attributes:
        cells: (3, cells) distances and gradients of all of them, one table after the other.
        first: (m,) index of the first cell of each section.
        width: (m,) number of cells along an edge of each.
    """

    cells: Array32
    first: Indices
    width: Indices

    @classmethod
    def of(cls, sections: Sequence[TargetSection]) -> SectionTables:
        """Join the tables of sections (m)."""
        flat = [s.table.reshape(-1, 3).T for s in sections]
        first = np.cumsum([0, *(f.shape[1] for f in flat[:-1])])
        return cls(
            np.ascontiguousarray(np.concatenate(flat, axis=1)), first, np.array([s.table.shape[1] for s in sections])
        )

    def table_at(self, which: Indices, level: Indices) -> TableAt:
        """Return the table of each pose, from the indices of its section (s,) and of its level in `LEVELS_M` (s,)."""
        width = self.width[which]
        return self.first[which] + level * width**2, width

    def look_up(self, x_m: Array, y_m: Array, table: TableAt) -> tuple[Array, Array, Array]:
        """Return distances (s, k), m, and their gradients along x and y (s, k), by bilinear interpolation.

        Args:
            x_m, y_m: (s, k) places of the ball's centre about the section's origin.
            table: The table of each pose, from `table_at`.
        """
        first, n = table[0][:, None], table[1][:, None]
        x, y = (np.clip(v / CELL_M + 0.5 * (n - 1), 0.0, n - 1 - 1e-6) for v in (x_m, y_m))
        i, j = x.astype(np.int64), y.astype(np.int64)
        x, y = x - i, y - j
        corner = first + i * n + j
        far = x * y
        corners = ((corner, 1 - x - y + far), (corner + 1, y - far), (corner + n, x - far), (corner + n + 1, far))
        distance, along_x, along_y = (sum(channel.take(at) * w for at, w in corners) for channel in self.cells)
        return distance, along_x, along_y


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
