"""Envelope of an object for clearance, independent of the fitted outline."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.touch.outline.polygons import minimum_rectangle
from glotouch_bt.perception.touch.values import Candidate, Contour
from glotouch_bt.robot import Array, ParamError


def envelope(candidate: Candidate) -> Contour:
    """Return the smaller of the circle and the rectangle that contain all contact points and the fitted outline.

    Few contacts leave gaps, and an outline omits protruding parts, so both are included.

    Returns:
        A Contour; its `residuals_m` are the signed distances of those points, never positive (rectangle: to its
        nearest side).
    """
    points = candidate.extent_K_m
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
    try:
        centre, size, yaw = minimum_rectangle(points)
    except ParamError:
        return None
    c, s = np.cos(yaw), np.sin(yaw)
    local = np.abs((points - centre) @ np.array([[c, -s], [s, c]]))
    inward = np.min(0.5 * np.asarray(size) - local, axis=1)
    return Contour("box", centre, size, yaw, 0.0, -np.abs(inward))
