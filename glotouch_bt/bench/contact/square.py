"""The calibration square: its true outline, and the fit to a run's contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glotouch_bt.mission.read import load_world
from glotouch_bt.perception.touch import fit_kind
from glotouch_bt.report import RunRecord
from glotouch_bt.robot import Array, BadInput, Pose
from glotouch_bt.robot.scene import load_folder

Tool = Literal["probe", "gripper"]
WORLD = "calibration_square"
TOOLS: tuple[Tool, ...] = ("probe", "gripper")


@dataclass(frozen=True)
class TrueSquare:
    """True pose and size of the upright block.

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


@dataclass(frozen=True)
class TracedSquare:
    """The square as a run estimated it, in B.

    Attributes:
        points_B_m: (k, 2) contact points.
        tips_B_m: (k, 2) positions of the tool's reference point.
        centre_B_m, side_m, yaw_rad: The fitted square: centre (2,), sides (2,) longer first, direction of the longer.
        tip_radius_m: Radius of the ball; 0 for the fingers.
    """

    points_B_m: Array
    tips_B_m: Array
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
    tips = np.array([c["tip_K_m"][:2] for c in contacts], dtype=np.float64)
    points = np.array([c["point_K_m"] for c in contacts], dtype=np.float64)
    radius = float(record.of_run("probe", "tip_radius_m")) if tool == "probe" else 0.0
    fit = fit_kind(tips if radius else points, radius, "box")
    return TracedSquare(
        _planar(pose_B_K, points),
        _planar(pose_B_K, tips),
        _planar(pose_B_K, fit.centre_K_m[None])[0],
        np.array(fit.size_m),
        fit.yaw_rad + pose_B_K.yaw_rad,
        radius,
    )


def true_square(record: RunRecord, when: Literal["start", "end"] = "end") -> TrueSquare:
    """Return the true square at the start or the end of a run."""
    item = record.truth[when][0]
    pose = Pose(np.array(item["pose_B_O"]["position_m"], float), np.array(item["pose_B_O"]["quat"], float))
    world = load_world(WORLD)
    (block,) = load_folder(world.objects.folder, world.objects.names)
    return TrueSquare(pose, block.extents_m[:2])


def _planar(pose_B_K: Pose, points_K_m: Array) -> Array:
    """Transform points (n, 2) on K's floor to B, (n, 2)."""
    return pose_B_K.apply(np.column_stack([points_K_m, np.zeros(len(points_K_m))]))[:, :2]
