"""Geometry of closed polygons (n, 2); the last vertex is joined to the first."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, ParamError

Indices = npt.NDArray[np.int64]
PARALLEL_RAD = 1e-9
"""Angle between neighbouring edges of a convex polygon below which they are one edge. Source: rounding."""
FLAT_M2 = 1e-14
"""Twice the area of three neighbouring points of a hull up to which the middle one is no corner. Source: rounding."""


def convex_hull(points_m: Array) -> Array:
    """Return the corners (m, 2) of the convex hull of points (n, 2), counter-clockwise.

    Raises:
        ParamError: The points span no area.
    """
    order = np.lexsort((points_m[:, 1], points_m[:, 0]))
    corners = np.zeros(len(order) + 1, dtype=np.int64)
    count = _hull(points_m, order, corners) if np.isfinite(points_m).all() else 0
    if count < 3:
        raise ParamError("points_m", np.shape(points_m), "at least three points that span an area")
    return np.asarray(points_m[corners[:count]], dtype=np.float64)


@compiled("given f8[:, :]", "i8[::1]", "i8[::1]")
def _hull(points: Array, order: Indices, corners: Indices) -> int:
    """Fill the corners of the convex hull of points (n, 2), counter-clockwise, and return their number.

    The lower chain, then the upper one (Andrew, IPL 9, 1979). Without an area there are fewer than three.

    Args:
        points: (n, 2), finite.
        order: (n,) their order by x, then y.
        corners: (n + 1,) filled.
    """
    kept = 0
    for chain in range(2):
        first = kept
        for k in range(len(order)):
            i = order[k] if chain == 0 else order[len(order) - 1 - k]
            while kept - first > 1:
                a, b = corners[kept - 2], corners[kept - 1]
                left = (points[b, 0] - points[a, 0]) * (points[i, 1] - points[a, 1])
                left -= (points[b, 1] - points[a, 1]) * (points[i, 0] - points[a, 0])
                if left > FLAT_M2:
                    break
                kept -= 1
            corners[kept] = i
            kept += 1
        kept -= 1  # the last one starts the other chain
    return kept


def star_hull(points_m: Array) -> Indices:
    """Return indices (m,) of the convex hull of a polygon (n, 2) ordered counter-clockwise around the origin inside it.

    Graham scan (IPL 1, 1972) without its sort: linear time.

    Raises:
        ParamError: The points span no area.
    """
    x, y = points_m.T.tolist()
    n = len(x)
    first = int(np.argmax(points_m[:, 0])) if n else 0  # always a corner of the hull
    kept: list[int] = []
    for i in [*range(first, n), *range(first + 1)]:
        xi, yi = x[i], y[i]
        while len(kept) > 1:
            a, b = kept[-2], kept[-1]
            if (x[b] - x[a]) * (yi - y[a]) - (y[b] - y[a]) * (xi - x[a]) > 0.0:
                break
            kept.pop()
        kept.append(i)
    if len(kept) < 4:
        raise ParamError("points_m", np.shape(points_m), "at least three points that span an area")
    return np.array(kept[:-1])


def area_and_centroid(polygon_m: Array) -> tuple[float, Array]:
    """Return signed area (counter-clockwise positive) and area centroid (2,), by Green's theorem."""
    middle = polygon_m.mean(axis=0)
    p = polygon_m - middle
    q = np.roll(p, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = 0.5 * float(cross.sum())
    if abs(area) < 1e-12:
        return area, middle
    return area, np.asarray(middle + (cross[:, None] * (p + q)).sum(axis=0) / (6.0 * area))


def minimum_rectangle(points_m: Array) -> tuple[Array, tuple[float, float], float]:
    """Return centre (2,), (long, short) and yaw of the long side, in [-pi/2, pi/2), of the minimum-area rectangle.

    One of its sides lies along an edge of the convex hull (Freeman and Shapira, CACM 18, 1975).

    Raises:
        ParamError: The points span no area.
    """
    hull = convex_hull(points_m)
    edges = np.roll(hull, -1, axis=0) - hull
    yaws = np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (0.5 * np.pi), 9))
    c, s = np.cos(yaws)[:, None], np.sin(yaws)[:, None]
    u, v = c * hull[:, 0] + s * hull[:, 1], c * hull[:, 1] - s * hull[:, 0]
    low, high = np.stack([u.min(1), v.min(1)], 1), np.stack([u.max(1), v.max(1)], 1)
    i = int(np.argmin(np.prod(high - low, axis=1)))
    yaw, size, middle = float(yaws[i]), high[i] - low[i], 0.5 * (low[i] + high[i])
    centre = np.array([[c[i, 0], -s[i, 0]], [s[i, 0], c[i, 0]]]) @ middle
    if size[1] > size[0]:
        size, yaw = size[::-1], yaw + 0.5 * np.pi
    return centre, (float(size[0]), float(size[1])), float((yaw + 0.5 * np.pi) % np.pi - 0.5 * np.pi)


def shrunk_convex(hull_m: Array, by_m: float) -> Array:
    """Return the erosion of a convex polygon by `by_m`: corners (m, 2), counter-clockwise.

    The intersection of the shifted half planes is the hull of their dual points about the centroid. Neighbouring edges
    that are parallel have no corner between them. If the centroid is eroded too, return the centroid alone (1, 2).
    """
    middle = area_and_centroid(hull_m)[1]
    edge = np.roll(hull_m, -1, axis=0) - hull_m
    length = np.linalg.norm(edge, axis=1)
    keep = length > 1e-9
    normal = np.stack([edge[keep, 1], -edge[keep, 0]], axis=1) / length[keep, None]
    offset = np.sum(normal * (hull_m[keep] - middle), axis=1) - by_m
    if np.min(offset) <= 1e-6:
        return middle[None, :]
    dual = normal / offset[:, None]
    dual = dual[star_hull(dual)]
    following = np.roll(dual, -1, axis=0)
    cross = dual[:, 0] * following[:, 1] - dual[:, 1] * following[:, 0]
    turned = cross > PARALLEL_RAD * np.linalg.norm(dual, axis=1) * np.linalg.norm(following, axis=1)
    step = (following - dual)[turned]
    return np.asarray(middle + np.stack([step[:, 1], -step[:, 0]], axis=1) / cross[turned, None])


def polygon_distance(polygon_m: Array, points_m: Array) -> Array:
    """Return signed distances (k,) of points (k, 2) from a polygon's outline, negative inside (even-odd rule)."""
    found = np.zeros(len(points_m))
    _polygon_distance(polygon_m, points_m, found)
    return found


@compiled("given f8[:, :]", "given f8[:, :]", "f8[::1]")
def _polygon_distance(polygon: Array, points: Array, found: Array) -> None:
    """See `polygon_distance`; `found` is filled."""
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        least, inside = np.inf, False
        for j in range(len(polygon)):
            ax, ay = polygon[j - 1, 0], polygon[j - 1, 1]  # the last edge first
            by = polygon[j, 1]
            ex, ey = polygon[j, 0] - ax, by - ay
            along = ((x - ax) * ex + (y - ay) * ey) / max(ex * ex + ey * ey, 1e-18)
            along = min(max(along, 0.0), 1.0)
            gx, gy = x - ax - along * ex, y - ay - along * ey
            least = min(least, gx * gx + gy * gy)
            if (ay > y) != (by > y) and x < ax + (y - ay) / ey * ex:
                inside = not inside
        found[i] = -np.sqrt(least) if inside else np.sqrt(least)


def nearest_distance(points_m: Array, others_m: Array) -> Array:
    """Return the distances (n,) of points (n, 2) from the nearest of others (m, 2), m > 0."""
    found = np.zeros(len(points_m))
    _nearest_distance(points_m, others_m, found)
    return found


@compiled("given f8[:, :]", "given f8[:, :]", "f8[::1]")
def _nearest_distance(points: Array, others: Array, found: Array) -> None:
    """See `nearest_distance`; `found` is filled."""
    for i in range(len(points)):
        least = np.inf
        for j in range(len(others)):
            x, y = points[i, 0] - others[j, 0], points[i, 1] - others[j, 1]
            least = min(least, x * x + y * y)
        found[i] = np.sqrt(least)
