"""The calibration square: its true outline, the square fitted to contacts, and how far points are from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, Pose
from glotouch_bt.touch import Contour, fit_kind


@dataclass(frozen=True)
class TrueSquare:
    """The upright block as it stands.

    Attributes:
        pose_B: Its frame in B, the origin at its middle.
        sides_m: (2,) its sides along its own x and y.
    """

    pose_B: Pose
    sides_m: Array

    @property
    def centre_B_m(self) -> Array:
        """(2,)."""
        return self.pose_B.position_m[:2]

    @property
    def yaw_rad(self) -> float:
        """Direction of its x axis."""
        return self.pose_B.yaw_rad

    @property
    def corners_B_m(self) -> Array:
        """(4, 2) counter-clockwise."""
        return rectangle(self.centre_B_m, self.sides_m, self.yaw_rad)


def rectangle(centre_m: Array, sides_m: Array, yaw_rad: float) -> Array:
    """(4, 2) corners of a rectangle, counter-clockwise."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    local = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * sides_m
    return np.asarray(local @ np.array([[c, s], [-s, c]]) + centre_m)


def fit_square(places_m: Array, radius_m: float) -> Contour:
    """The rectangle through contacts: ball centres (k, 2) with the ball's radius, or contact points with 0."""
    return fit_kind(places_m, radius_m, "box")


def polygon_distance(points_m: Array, polygon_m: Array) -> Array:
    """(n,) signed distance of points (n, 2) from a convex polygon (m, 2), counter-clockwise; negative inside."""
    start = np.asarray(polygon_m, dtype=np.float64)
    edge = np.roll(start, -1, axis=0) - start
    offset = np.asarray(points_m, dtype=np.float64)[:, None] - start
    share = np.clip((offset * edge).sum(-1) / (edge * edge).sum(-1), 0.0, 1.0)
    nearest = np.linalg.norm(offset - share[..., None] * edge, axis=-1).min(axis=1)
    outside = (edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0]).min(axis=1) < 0.0
    return np.asarray(np.where(outside, nearest, -nearest))
