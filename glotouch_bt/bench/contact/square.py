"""The calibration square: its true outline, and the fit to a run's contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glotouch_bt.perception.touch import fit_kind
from glotouch_bt.report import RunRecord
from glotouch_bt.robot import Array, BadInput, Pose

Tool = Literal["probe", "gripper"]
TOOLS: tuple[Tool, ...] = ("probe", "gripper")


@dataclass(frozen=True)
class TrueSquare:
    """Horizontal section of the true block at the height of the contacts.

    The block may lean: its outline at the height of the ball is not the one of its base.

    Attributes:
        corners_B_m: (4, 2) counter-clockwise.
    """

    corners_B_m: Array

    @classmethod
    def section(cls, pose_B: Pose, sides_m: Array, height_B_m: float) -> TrueSquare:
        """Intersect the block's upright edges with a horizontal plane.

        Args:
            pose_B: The block's frame in B, the origin in the middle of its base.
            sides_m: (2,) its sides along its own x and y.
            height_B_m: Height of the plane in B.
        """
        base = pose_B.apply(np.column_stack([rectangle(np.zeros(2), sides_m, 0.0), np.zeros(4)]))
        edge = pose_B.rotation[:, 2]
        along = (height_B_m - base[:, 2]) / edge[2]
        return cls((base + along[:, None] * edge)[:, :2])

    @property
    def centre_B_m(self) -> Array:
        """(2,)."""
        return np.asarray(self.corners_B_m.mean(axis=0))

    @property
    def sides_m(self) -> Array:
        """(2,) lengths of the first two sides."""
        return np.asarray(np.linalg.norm(np.diff(self.corners_B_m[:3], axis=0), axis=1))

    @property
    def yaw_rad(self) -> float:
        """Direction of its x axis."""
        x, y = self.corners_B_m[0] - self.corners_B_m[1]
        return float(np.arctan2(y, x))


@dataclass(frozen=True)
class TracedSquare:
    """The square as a run estimated it, in B.

    Attributes:
        points_B_m: (k, 2) contact points.
        tips_B_m: (k, 2) positions of the tool's reference point.
        height_B_m: Mean height of the reference point.
        centre_B_m, side_m, yaw_rad: The fitted square: centre (2,), sides (2,) longer first, direction of the longer.
        tip_radius_m: Radius of the ball; 0 for the fingers.
    """

    points_B_m: Array
    tips_B_m: Array
    height_B_m: float
    centre_B_m: Array
    side_m: Array
    yaw_rad: float
    tip_radius_m: float


def rectangle(centre_m: Array, sides_m: Array, yaw_rad: float) -> Array:
    """(4, 2) corners of a rectangle, counter-clockwise."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    local = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * sides_m
    return np.asarray(local @ np.array([[c, s], [-s, c]]) + centre_m)


def traced_square(record: RunRecord, tool: Tool, fixed: bool) -> TracedSquare:
    """Return the contacts of the traced candidate and the square fitted to them.

    A trace moves its contacts along with an object it pushed. The bolted square cannot move, so its contacts are used
    uncorrected.

    Raises:
        BadInput: The record holds no candidate.
    """
    pose_B_K = record.pose_B_K
    found = record.of_kind("candidate")
    if not found or pose_B_K is None:
        raise BadInput(f"{record.path}: holds no traced square")
    contacts = found[-1].data["candidate"]["contacts"]
    if fixed:
        felt = {c["stamp_s"]: c for e in record.of_kind("contact") for c in (e.data["contact"],)}
        contacts = [felt[c["stamp_s"]] for c in contacts]
    places = np.array([c["tip_K_m"] for c in contacts], dtype=np.float64)
    tips = places[:, :2]
    points = np.array([c["point_K_m"] for c in contacts], dtype=np.float64)
    radius = float(record.of_run("probe", "tip_radius_m")) if tool == "probe" else 0.0
    fit = fit_kind(tips if radius else points, radius, "box")
    return TracedSquare(
        _planar(pose_B_K, points),
        _planar(pose_B_K, tips),
        float(pose_B_K.apply(places)[:, 2].mean()),
        _planar(pose_B_K, fit.centre_K_m[None])[0],
        np.array(fit.size_m),
        fit.yaw_rad + pose_B_K.yaw_rad,
        radius,
    )


def true_square(record: RunRecord, height_B_m: float, when: Literal["start", "end"] = "end") -> TrueSquare:
    """Return the true square at the start or the end of a run, as large as it is, at a height in B."""
    item = record.truth[when][0]
    pose = Pose(np.array(item["pose_B_O"]["position_m"], float), np.array(item["pose_B_O"]["quat"], float))
    return TrueSquare.section(pose, np.array(item["size_m"][:2], float), height_B_m)


def _planar(pose_B_K: Pose, points_K_m: Array) -> Array:
    """Transform points (n, 2) on K's floor to B, (n, 2)."""
    return pose_B_K.apply(np.column_stack([points_K_m, np.zeros(len(points_K_m))]))[:, :2]
