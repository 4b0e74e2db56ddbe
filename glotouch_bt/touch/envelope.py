"""The room an object takes, whatever outline was fitted to it: for keeping clear of it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from glotouch_bt.robot import Array
from glotouch_bt.touch.values import Candidate, Contour


def envelope(candidate: Candidate) -> Contour:
    """The smaller of the circle and the rectangle that hold every contact point and the fitted outline's own extent.

    Returns:
        A Contour whose `residuals_m` are the (never positive) distances of the contacts inside it, for the rectangle
        the distance to its nearest side.
    """
    points = np.array([c.point_K_m for c in candidate.contacts])
    circle = _circle(points, candidate.contour.centre_K_m)
    box = _rectangle(points)
    if box is None or np.pi * circle.radius_m**2 <= box.size_m[0] * box.size_m[1]:
        return circle
    return box


def _circle(points: Array, centre: Array) -> Contour:
    distance = np.linalg.norm(points - centre, axis=1)
    diameter = 2.0 * float(distance.max())
    return Contour("round", centre, (diameter, diameter), 0.0, 0.0, distance - distance.max())


def _rectangle(points: Array) -> Contour | None:
    """Least-area rectangle: one side lies along an edge of the convex hull (Freeman and Shapira, CACM 18, 1975)."""
    try:
        hull = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        return None
    edges = np.roll(hull, -1, axis=0) - hull
    best: tuple[float, float, Array, Array] | None = None
    for yaw in np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (0.5 * np.pi), 9)):
        c, s = np.cos(yaw), np.sin(yaw)
        local = hull @ np.array([[c, -s], [s, c]])
        low, high = local.min(axis=0), local.max(axis=0)
        area = float(np.prod(high - low))
        if best is None or area < best[0]:
            best = (area, float(yaw), low, high)
    assert best is not None
    _, yaw, low, high = best
    size = high - low
    c, s = np.cos(yaw), np.sin(yaw)
    inward = np.minimum(points @ np.array([[c, -s], [s, c]]) - low, high - points @ np.array([[c, -s], [s, c]])).min(
        axis=1
    )
    centre = np.array([[c, -s], [s, c]]) @ (0.5 * (low + high))
    if size[1] > size[0]:
        size, yaw = size[::-1], yaw + 0.5 * np.pi
    yaw = (yaw + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return Contour("box", centre, (float(size[0]), float(size[1])), float(yaw), 0.0, -np.abs(inward))
