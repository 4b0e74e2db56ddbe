"""The probe section of a mesh: positions the ball's centre cannot take at one height.

With the ball (radius r) at height z0 and the shaft (radius s) above it, position p is forbidden if a mesh point q

- is nearer to the ball's centre (p, z0) than r, or
- lies above z0 and is nearer to the shaft's axis than s.

Both distances come from dense samples of the surface, so the boundary of the forbidden set is accurate to about
SAMPLE_M^2 / (8 s), a few hundredths of a millimetre. It is converted to polygons and to a signed distance grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt
import scipy
import trimesh
from contourpy import contour_generator

from glotouch_bt.perception.touch import area_and_centroid, minimum_rectangle
from glotouch_bt.robot import Array, Probe
from glotouch_bt.robot.scene import Mesh

SENSING_HEIGHT_M = 0.018
GRID_M = 0.0005
SAMPLE_M = 0.0005
"""Spacing of surface samples."""
THIN_M = 0.0002
"""Edge of the cubes in which duplicate samples are merged."""
COARSE = 4
BORDER_M = 0.010
"""Margin of the grid around the forbidden set; distances beyond it are lower bounds."""


@dataclass(frozen=True, eq=False)
class SignedGrid:
    """A signed distance on a square grid, negative inside; bilinear between the nodes.

    Attributes:
        origin_m: (2,) position of the first node.
        values_m: (nx, ny) signed distances.
    """

    origin_m: Array
    values_m: Array

    def __call__(self, points_m: Array) -> Array:
        """Return signed distances (n,) at points (n, 2); beyond the grid, the border value plus the distance to it."""
        last = np.array(self.values_m.shape) - 1.0
        at = (points_m - self.origin_m) / GRID_M
        inside = np.minimum(np.maximum(at, 0.0), last - 1e-9)
        beyond = np.sqrt(((at - inside) ** 2).sum(axis=1)) * GRID_M
        cell = inside.astype(np.int64)
        t, u = (inside - cell).T
        flat = self.values_m.ravel()
        wide = self.values_m.shape[1]
        k = cell[:, 0] * wide + cell[:, 1]
        low = flat[k] * (1 - u) + flat[k + 1] * u
        high = flat[k + wide] * (1 - u) + flat[k + wide + 1] * u
        return np.asarray(low * (1 - t) + high * t + beyond)

    def gradient(self, point_m: Array) -> Array:
        """Return the unit vector (2,) away from the shape at a point (2,), by central differences over a grid step."""
        h = GRID_M
        steps = np.array([[h, 0.0], [-h, 0.0], [0.0, h], [0.0, -h]])
        v = self(np.asarray(point_m) + steps)
        g = np.array([v[0] - v[1], v[2] - v[3]])
        return np.asarray(g / max(float(np.linalg.norm(g)), 1e-12))

    def level(self, value_m: float) -> list[Array]:
        """Return the closed polygons (n, 2) of a level, largest first, with the first point repeated at the end."""
        x, y = (self.origin_m[i] + GRID_M * np.arange(self.values_m.shape[i]) for i in (0, 1))
        lines = contour_generator(x, y, self.values_m.T).lines(value_m)
        found = [np.asarray(line, dtype=np.float64) for line in lines if len(line) > 3]
        return sorted(found, key=lambda p: -abs(area_and_centroid(p)[0]))


@dataclass(frozen=True, eq=False)
class FeltSection:
    """Probe section of one mesh, in the mesh frame, seen from above.

    Attributes:
        name: Name of the mesh.
        side: Signed distance of the ball's centre from the forbidden set at sensing height.
        above: The same for a ball lowered from above.
        outline_m: (n, 2) closed polygon of the largest part: the forbidden set shrunk by the ball's radius.
        centre_m: (2,) centre of area of the convex hull of all outlines: the object's centre.
        box_size_m, box_yaw_rad: Long and short side of its minimum-area rectangle, and direction of the long side.
        top_m: Highest vertex above the floor.
        pressed_m: (2,) centre of mass seen from above; a push rotates the object about it.
        points_m: (n, 3) surface samples at and above the sensing height.
        tip_radius_m: Radius of the ball.
    """

    name: str
    side: SignedGrid
    above: SignedGrid
    outline_m: Array
    centre_m: Array
    box_size_m: tuple[float, float]
    box_yaw_rad: float
    top_m: float
    pressed_m: Array
    points_m: Array
    tip_radius_m: float

    @cached_property
    def reach_m(self) -> float:
        """Return the radius about the mesh origin beyond which the ball touches nothing."""
        return float(np.linalg.norm(np.concatenate(self.side.level(0.0)), axis=1).max())

    @property
    def elongation(self) -> float:
        """Return the aspect ratio of the minimum-area rectangle."""
        return self.box_size_m[0] / self.box_size_m[1]

    def landing_height_m(self, point_m: Array) -> float:
        """Return the height of the ball's centre above the floor when lowered onto the object at a point (2,)."""
        d2 = ((self.points_m[:, :2] - point_m) ** 2).sum(axis=1)
        under = d2 < self.tip_radius_m**2
        if not under.any():
            return SENSING_HEIGHT_M
        return float(np.max(self.points_m[under, 2] + np.sqrt(self.tip_radius_m**2 - d2[under])))


def felt_section(mesh: Mesh, probe: Probe | None = None) -> FeltSection:
    """Return the probe section of a mesh with the ball's centre at `SENSING_HEIGHT_M`; cached in memory.

    Raises:
        ValueError: The mesh does not reach that height.
    """
    return _section(_Keyed(mesh.digest, mesh), probe or Probe())


@dataclass(frozen=True)
class _Keyed:
    """A mesh that compares by its digest, for the cache."""

    digest: str
    mesh: Mesh = field(compare=False)


@lru_cache(maxsize=64)
def _section(key: _Keyed, probe: Probe) -> FeltSection:
    mesh = key.mesh
    r, s = probe.tip_radius_m, 0.5 * probe.shaft_diameter_m
    solid = mesh.as_trimesh()
    points = _surface(solid, SENSING_HEIGHT_M - r, SENSING_HEIGHT_M - r + probe.length_m)
    if len(points) == 0:
        raise ValueError(f"{mesh.name}: nothing of it reaches the probe at {SENSING_HEIGHT_M * 1e3:.0f} mm")
    low = points[:, :2].min(axis=0) - r - BORDER_M
    high = points[:, :2].max(axis=0) + r + BORDER_M
    shape = np.ceil((high - low) / GRID_M).astype(np.int64) + 1
    shape += -shape % COARSE  # whole coarse cells
    by_ball = scipy.spatial.cKDTree(points, balanced_tree=False)
    upper = points[points[:, 2] >= SENSING_HEIGHT_M, :2]
    by_shaft = scipy.spatial.cKDTree(_thinned(upper), balanced_tree=False) if len(upper) else None

    def gap(places: Array, shaft_m: float) -> Array:
        """Return the distance of a probe with shaft radius `shaft_m` from the surface, ball at places (n, 2)."""
        ball = by_ball.query(np.column_stack([places, np.full(len(places), SENSING_HEIGHT_M)]))[0] - r
        return np.asarray(ball if by_shaft is None else np.minimum(ball, by_shaft.query(places)[0] - shaft_m))

    side, above = (
        _signed(solid, low, _near_zero(lambda places, t=t: gap(places, t), low, shape))  # type: ignore[misc]
        for t in (s, r)
    )
    shrunk = side.level(-r)
    corners = np.concatenate(shrunk)
    polygon = corners[scipy.spatial.ConvexHull(corners).vertices]
    _, size, yaw = minimum_rectangle(polygon)
    return FeltSection(
        name=mesh.name,
        side=side,
        above=above,
        outline_m=shrunk[0],
        centre_m=area_and_centroid(polygon)[1],
        box_size_m=size,
        box_yaw_rad=yaw,
        top_m=float(mesh.vertices_m[:, 2].max()),
        pressed_m=np.asarray(solid.center_mass[:2], dtype=np.float64),
        points_m=points[points[:, 2] >= SENSING_HEIGHT_M],
        tip_radius_m=r,
    )


def _surface(solid: trimesh.Trimesh, low_m: float, high_m: float) -> Array:
    """Return surface points (n, 3) at most SAMPLE_M apart between two heights."""
    triangles = np.asarray(solid.triangles)
    z = triangles[:, :, 2]
    near = (z.max(axis=1) >= low_m) & (z.min(axis=1) <= high_m)
    if not near.any():
        return np.zeros((0, 3))
    points = _lattice(triangles[near])
    return _thinned(points[(points[:, 2] >= low_m) & (points[:, 2] <= high_m)])


def _lattice(triangles: Array) -> Array:
    """Sample triangles (n, 3, 3) with points (m, 3), corners included: rows along the longest edge, SAMPLE_M apart."""
    length = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    turn = (np.argmax(length, axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn[:, :, None], axis=1).transpose(1, 0, 2)
    longest = length.max(axis=1)
    height = np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.maximum(longest, 1e-12)
    rows = np.ceil(height / SAMPLE_M).astype(np.int64) + 1
    of, row = _counted(rows)
    t = (row / np.maximum(rows[of] - 1, 1))[:, None]
    start, end = a[of] + t * (c - a)[of], b[of] + t * (c - b)[of]
    columns = np.ceil(longest[of] * (1.0 - t[:, 0]) / SAMPLE_M).astype(np.int64) + 1
    of, column = _counted(columns)
    u = (column / np.maximum(columns[of] - 1, 1))[:, None]
    return np.asarray(start[of] + u * (end - start)[of])


def _counted(counts: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Repeat each index of `counts` (n,) by its count; return the indices and a running number within each."""
    of = np.repeat(np.arange(len(counts)), counts)
    return of, np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)


def _thinned(points: Array) -> Array:
    """Keep one point in every cube of THIN_M: adjacent faces repeat their edges, walls repeat from above."""
    cell = np.floor(points / THIN_M).astype(np.int64)
    cell -= cell.min(axis=0)
    key = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    return np.asarray(points[np.unique(key, return_index=True)[1]])


def _nodes(origin: Array, shape: npt.NDArray[np.int64]) -> Array:
    """Return the positions (nx, ny, 2) of a grid's nodes."""
    return np.asarray(origin + GRID_M * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1))


def _near_zero(gap: Callable[[Array], Array], origin: Array, shape: npt.NDArray[np.int64]) -> Array:
    """Evaluate a distance at the nodes (nx, ny): exact near its zero level, elsewhere with the right sign.

    The distance at every fourth node bounds how far away the zero level is.
    """
    nodes = _nodes(origin, shape)
    coarse = nodes[COARSE // 2 :: COARSE, COARSE // 2 :: COARSE]
    rough = gap(coarse.reshape(-1, 2)).reshape(coarse.shape[:2])
    field = np.kron(rough, np.ones((COARSE, COARSE)))
    near = np.abs(field) < 2 * COARSE * GRID_M
    field[near] = gap(nodes[near])
    return np.asarray(field)


def _signed(solid: trimesh.Trimesh, origin: Array, field: Array) -> SignedGrid:
    """Convert the unsigned gap to the surface (nx, ny) to a signed distance.

    Regions of positive gap outside the solid are outside; regions within the solid are inside.
    """
    parts, count = scipy.ndimage.label(field > 0.0)
    solidly = np.zeros(count + 1, dtype=np.bool_)
    deepest = [int(np.argmax(np.where(parts == k, field, -np.inf))) for k in range(1, count + 1)]
    if deepest:
        ij = np.column_stack(np.unravel_index(deepest, field.shape))
        places = np.column_stack([origin + GRID_M * ij, np.full(len(ij), SENSING_HEIGHT_M)])
        solidly[1:] = solid.contains(places)
    within = solidly[parts]
    signed = np.where(within, -np.abs(field) - GRID_M, field)
    # the band between both kinds of region is negative everywhere, so the only zero level is the boundary
    grid = SignedGrid(np.asarray(origin), signed)
    nodes = _nodes(origin, np.array(field.shape)).reshape(-1, 2)
    distance = _to_polygons(grid.level(0.0), nodes).reshape(field.shape)
    return SignedGrid(np.asarray(origin), np.where(signed > 0.0, distance, -distance))


def _to_polygons(polygons: list[Array], nodes: Array) -> Array:
    """Return distances (n,) of nodes (n, 2) from closed polygons, by the edges at the nearest vertex."""
    vertex = np.concatenate([p[:-1] for p in polygons])
    before = np.concatenate([np.roll(p[:-1], 1, axis=0) for p in polygons])
    after = np.concatenate([np.roll(p[:-1], -1, axis=0) for p in polygons])
    nearest = scipy.spatial.cKDTree(vertex).query(nodes, k=min(2, len(vertex)))[1].reshape(len(nodes), -1)
    best = np.full(len(nodes), np.inf)
    for k in nearest.T:
        for other in (before[k], after[k]):
            edge = other - vertex[k]
            to = nodes - vertex[k]
            t = np.clip((to * edge).sum(axis=1) / np.maximum((edge**2).sum(axis=1), 1e-18), 0.0, 1.0)
            best = np.minimum(best, np.linalg.norm(to - t[:, None] * edge, axis=1))
    return best
