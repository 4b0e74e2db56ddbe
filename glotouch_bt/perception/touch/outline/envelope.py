"""Bounds of a candidate's contacts and outline, for search and clearance."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.touch.outline.polygons import area_and_centroid, convex_hull, minimum_rectangle
from glotouch_bt.perception.touch.values import Candidate, Contour
from glotouch_bt.robot import Array, ParamError

KNOWN_QUALITY = 0.3
"""Minimum quality of a candidate beside another one that counts without doubt: the centre's standard deviation is below
8 mm. Source: ours."""
CONTACT_M = 0.002
"""Half extent of a contact in the footprint of an object whose outline is uncertain. Source: ours."""


def envelope(candidate: Candidate) -> Contour:
    """Return the smaller of the circle and the rectangle that contain all contact points and the fitted outline.

    Few contacts leave gaps, and an outline omits protruding parts, so both are included. The result is kept with the
    candidate, of which it is asked at every contact.

    Returns:
        A Contour; its `residuals_m` are the signed distances of those points, never positive (rectangle: to its
        nearest side).
    """
    kept = vars(candidate)
    if "_envelope" not in kept:
        kept["_envelope"] = _envelope(candidate)
    found: Contour = kept["_envelope"]
    return found


def _envelope(candidate: Candidate) -> Contour:
    points = candidate.extent_K_m
    circle = _circle(points, candidate.contour.centre_K_m)
    box = _rectangle(points)
    if box is None or np.pi * circle.radius_m**2 <= box.size_m[0] * box.size_m[1]:
        return circle
    return box


def footprint(candidate: Candidate, *, presumed: bool = True) -> Array:
    """Return the corners (n, 2) in K, counter-clockwise, of the convex hull of contact points and fitted outline.

    Args:
        candidate: The object.
        presumed: If its quality is below `KNOWN_QUALITY`, include the outline all the same; else only the contacts.
    """
    if presumed or candidate.quality >= KNOWN_QUALITY:
        return convex_hull(candidate.extent_K_m)
    met = np.array([c.point_K_m for c in candidate.contacts])
    corners = CONTACT_M * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    return convex_hull((met[:, None] + corners).reshape(-1, 2))


def occupied(candidate: Candidate) -> Contour:
    """Return where certainly nothing else stands: the envelope, or only the hull of the contacts if the quality is
    below `KNOWN_QUALITY`. A search then also looks where such a candidate is only presumed.
    """
    if candidate.quality >= KNOWN_QUALITY:
        return envelope(candidate)
    try:
        hull = convex_hull(np.array([c.point_K_m for c in candidate.contacts]))
    except ParamError:
        return envelope(candidate)
    size, yaw = minimum_rectangle(hull)[1:]
    middle = area_and_centroid(hull)[1]
    return Contour("box", middle, (size[0], size[1]), yaw, 0.0, np.zeros(0), family="free", boundary_K_m=hull)


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
