"""Outlines of obstacles, made by formula."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def rectangle(centre_m: npt.ArrayLike, size_m: tuple[float, float], yaw_rad: float = 0.0) -> Array:
    """Return the corners (4, 2) of a rectangle of size_m (along yaw, across), counter-clockwise."""
    local = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * size_m
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.asarray(centre_m) + local @ np.array([[c, s], [-s, c]])


def disc(centre_m: npt.ArrayLike, diameter_m: float, sides: int = 720) -> Array:
    """Return a polygon (sides, 2) in a circle; with 720 sides, it is 1e-5 of the radius smaller."""
    a = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    return np.asarray(centre_m) + 0.5 * diameter_m * np.stack([np.cos(a), np.sin(a)], axis=1)
