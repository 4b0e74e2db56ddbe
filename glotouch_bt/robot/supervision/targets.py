"""Compare measured poses with commanded ones."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.robot.geometry import Array

MAX_NORM_ERROR = 0.01
"""Tolerated error of a quaternion's squared norm. Source: ours."""
NOWHERE: Array = np.zeros(0)
"""A target that is not known."""


@compiled(
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:]",
    "f8",
)
def way_to_target(
    q: Array, dq: Array, position: Array, quat: Array, wrench: Array, limits: Array, target: Array, min_dot: float
) -> float:
    """Return the distance of the hand's newest position from its target, or -1 if any reading is out of its range.

    Args:
        q, dq, position, quat, wrench: The samples of an `Observation`.
        limits: (4, dof) least and greatest angle, greatest speed; and reach, stop force, stop torque.
        target: (7,) position and quaternion of P in B, or `NOWHERE`.
        min_dot: Least inner product of the newest quaternion with that of the target.
    """
    n, dof = q.shape
    reach, stop_N, stop_Nm = limits[3, 0], limits[3, 1], limits[3, 2]
    for i in range(n):
        force_2 = torque_2 = norm_2 = 0.0
        for j in range(dof):
            if not (math.isfinite(q[i, j]) and abs(dq[i, j]) <= limits[2, j]):
                return -1.0
        for j in range(3):
            if not abs(position[i, j]) <= reach:
                return -1.0
            force_2 += wrench[i, j] ** 2
            torque_2 += wrench[i, j + 3] ** 2
        for j in range(4):
            norm_2 += quat[i, j] ** 2
        if not (force_2 < stop_N**2 and torque_2 < stop_Nm**2 and abs(norm_2 - 1.0) <= MAX_NORM_ERROR):
            return -1.0
    for j in range(dof):
        if not limits[0, j] <= q[n - 1, j] <= limits[1, j]:
            return -1.0
    if len(target) == 0:
        return 0.0
    dot = away_2 = 0.0
    for j in range(3):
        away_2 += (position[n - 1, j] - target[j]) ** 2
    for j in range(4):
        dot += quat[n - 1, j] * target[3 + j]
    return math.sqrt(away_2) if abs(dot) >= min_dot else -1.0


def distance_to_path(point: list[float], path: list[list[float]]) -> float:
    """Return the distance of a point (3,) from a path of points joined by straight lines."""
    x, y, z = point
    least = math.dist(point, path[0])
    for (a, b, c), (d, e, f) in pairwise(path):
        u, v, w = d - a, e - b, f - c
        length_2 = u * u + v * v + w * w
        along = 0.0 if length_2 == 0.0 else ((x - a) * u + (y - b) * v + (z - c) * w) / length_2
        along = min(max(along, 0.0), 1.0)
        least = min(least, math.dist(point, (a + along * u, b + along * v, c + along * w)))
    return least


def angle_rad(a: list[float], b: list[float]) -> float:
    """Return the angle between two rotations given as unit quaternions."""
    half = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 2.0 * math.acos(min(1.0, half))
