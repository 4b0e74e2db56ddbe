"""Space for the fingers: how far the open fingers beside an object stay from its neighbours and from the walls.

Planar, in K. Neighbours count with the convex hulls of their contacts and outlines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch import Candidate, polygon_distance
from glotouch_bt.perception.touch.outline import footprint
from glotouch_bt.robot import Array, Gripper
from glotouch_skills.common.hand import CLEARANCE_M
from glotouch_skills.common.planning.squeeze_plan import Stance, side_gaps_m
from glotouch_skills.common.planning.touch_options import stances_over

SAMPLE_M = 0.003
"""Spacing of the points on an outline. The distance to its corners is exact, so the error is below 0.4 mm at a corner
of a finger. Source: ours."""
SIDE_GAP_M = 0.010
"""Gap between open jaw and object on each side. Source: the default of `ClosureParams`."""


@dataclass(frozen=True, eq=False)
class Neighbour:
    """The footprint of a candidate.

    Attributes:
        index: Index of the candidate.
        corners_K_m: (m, 2) corners of its convex outline.
        points_K_m: (n, 2) points on it, at most `SAMPLE_M` apart.
    """

    index: int
    corners_K_m: Array
    points_K_m: Array

    @classmethod
    def of(cls, candidate: Candidate) -> Neighbour:
        """Return the footprint of a candidate, sampled."""
        return cls.within(candidate.index, footprint(candidate))

    @classmethod
    def within(cls, index: int, corners_K_m: Array) -> Neighbour:
        """Return the same for a convex outline (m, 2)."""
        return cls(index, corners_K_m, sampled(np.concatenate([corners_K_m, corners_K_m[:1]])))

    def distance_m(self, points_K_m: Array) -> Array:
        """Return the signed distances (n,) of points (n, 2), negative inside."""
        return polygon_distance(self.corners_K_m, points_K_m)

    def moved(self, shift_K_m: Array) -> Neighbour:
        """Return the same, displaced by a vector (2,)."""
        return Neighbour(self.index, self.corners_K_m + shift_K_m, self.points_K_m + shift_K_m)


@dataclass(frozen=True, eq=False)
class Rectangle:
    """A rectangle in K, the outline of fingers seen from above.

    Attributes:
        centre_K_m: (2,).
        yaw_rad: Direction of its first side.
        half_m: (2,) half sides.
    """

    centre_K_m: Array
    yaw_rad: float
    half_m: Array

    @property
    def axes(self) -> Array:
        """(2, 2), one axis a row."""
        c, s = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        return np.array([[c, s], [-s, c]])

    @property
    def corners_K_m(self) -> Array:
        """(4, 2)."""
        signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
        return np.asarray(self.centre_K_m + (signs * self.half_m) @ self.axes)

    def distance_m(self, points_K_m: Array) -> Array:
        """Return the signed distances (n,) of points (n, 2), negative inside."""
        beyond = np.abs((points_K_m - self.centre_K_m) @ self.axes.T) - self.half_m
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))


def sampled(outline_m: Array) -> Array:
    """Return points (n, 2) on a closed polyline (m, 2), at most `SAMPLE_M` apart, with its corners."""
    start, side = outline_m[:-1], np.diff(outline_m, axis=0)
    steps = np.maximum(np.ceil(np.linalg.norm(side, axis=1) / SAMPLE_M), 1).astype(np.int64)
    share = (np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)) / np.repeat(steps, steps)
    return np.asarray(np.repeat(start, steps, axis=0) + share[:, None] * np.repeat(side, steps, axis=0))


def clearance_m(rectangle: Rectangle, neighbours: Sequence[Neighbour], half_extent_m: Array) -> float:
    """Return the distance of a rectangle from the nearest neighbour or wall, negative if they overlap.

    Args:
        rectangle: In K.
        neighbours: What stands there.
        half_extent_m: (2,) half of the container's interior.
    """
    least = float((half_extent_m - np.abs(rectangle.corners_K_m)).min())
    for other in neighbours:
        least = min(least, float(rectangle.distance_m(other.points_K_m).min()))
        inside = other.distance_m(rectangle.centre_K_m[None])[0]
        least = min(least, float(inside)) if inside < 0.0 else least  # the rectangle may be wholly inside
    return least


def gap_m(one: Neighbour, other: Neighbour) -> float:
    """Return the distance of two footprints, negative if one has points inside the other."""
    return float(
        min(
            one.distance_m(other.points_K_m).min(),
            other.distance_m(one.points_K_m).min(),
        )
    )


def wall_gap_m(one: Neighbour, half_extent_m: Array) -> float:
    """Return the distance of a footprint from the nearest wall."""
    return float((half_extent_m - np.abs(one.points_K_m)).min())


def fingers(at: Stance, gripper: Gripper) -> tuple[Rectangle, Rectangle]:
    """Return the outlines of both open fingers at a stance."""
    across = np.array([-np.sin(at.yaw_K_rad), np.cos(at.yaw_K_rad)])
    along = np.array([across[1], -across[0]])
    finger = gripper.finger
    half = np.asarray(finger.half_m[:2])
    middle = np.asarray(at.position_K_m) + finger.centre_m[0] * along
    off = (0.5 * at.opening_m + finger.centre_m[1]) * across
    return Rectangle(middle + off, at.yaw_K_rad, half), Rectangle(middle - off, at.yaw_K_rad, half)


def finger_clearance_m(at: Stance, neighbours: Sequence[Neighbour], half_extent_m: Array, gripper: Gripper) -> float:
    """Return the distance of the open fingers at a stance from the nearest neighbour or wall."""
    return min(clearance_m(finger, neighbours, half_extent_m) for finger in fingers(at, gripper))


def finger_space_m(
    target: Candidate, neighbours: Sequence[Neighbour], half_extent_m: Array, gripper: Gripper, at: Array | None = None
) -> float:
    """Return the clearance of the open fingers over an object, at the stance where it is largest.

    Minus infinity if there is no stance.

    Args:
        target: The object between the fingers.
        neighbours: The other objects.
        half_extent_m: (2,) half of the container's interior.
        gripper: The robot's gripper.
        at: (n,) bool, the stances that count, as of `cramped_stances`; None: all.
    """
    stances = stances_over(target, gripper, SIDE_GAP_M)
    some = stances if at is None else [s for s, counts in zip(stances, at, strict=True) if counts]
    return max((finger_clearance_m(s, neighbours, half_extent_m, gripper) for s in some), default=-np.inf)


def cramped_stances(
    target: Candidate, neighbours: Sequence[Neighbour], half_extent_m: Array, gripper: Gripper
) -> Array:  # fmt: skip
    """Return which stances (n,) over an object, bool, lack space for the fingers at each opening that is tried.

    The stances move with the object, in the same order, if it is displaced. Arguments as of `finger_space_m`.
    """
    rated = [
        [finger_clearance_m(at, neighbours, half_extent_m, gripper) for at in stances_over(target, gripper, gap_m)]
        for gap_m in side_gaps_m(SIDE_GAP_M)
    ]
    return np.asarray(np.max(rated, axis=0) < CLEARANCE_M, dtype=bool)
