"""Convex collision shapes of the arm, the hand, the probe and the world, built once for python-fcl."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from glotouch_bt.lazy import lazy_module
from glotouch_bt.robot import Array, Gripper, ParamError, Pose, Probe, RobotDescription, World

if TYPE_CHECKING:
    import fcl
else:
    fcl = lazy_module("fcl")

HOLDER_GAP_M = 0.003
"""Gap between the lower face of the handle and the top of the holder block."""
WALLS = ("wall +x", "wall -x", "wall +y", "wall -y")
OWN_OBSTACLES = (*WALLS, "floor", "table", "holder", "probe")
_TABLE_HALF_M = (2.0, 2.0, 0.1)
"""Half sizes of the table under the container, modelled as a large slab."""


@dataclass
class MovingPart:
    """A moving convex shape: its pose in a link's frame and the half sizes of its bounding box there."""

    name: str
    link: int
    rotation: Array
    origin_m: Array
    half_m: Array
    body: fcl.CollisionObject


@dataclass
class Obstacle:
    """A fixed convex shape in B and its axis-aligned bounding box."""

    name: str
    centre_m: Array
    half_m: Array
    body: fcl.CollisionObject


def _part(name: str, link: int, pose: Pose, half_m: Array, shape: fcl.CollisionGeometry) -> MovingPart:
    return MovingPart(
        name, link, pose.rotation.copy(), pose.position_m.copy(), half_m, fcl.CollisionObject(shape, fcl.Transform())
    )


def arm_parts(description: RobotDescription) -> list[MovingPart]:
    """Return the capsules of the moving links, then the gripper's body and its closed fingers."""
    parts = []
    for i, joint in enumerate(description.joints):
        for capsule in joint.link.capsules:
            start, end = np.array(capsule.start_m), np.array(capsule.end_m)
            pose = Pose.from_matrix(0.5 * (start + end), _rotation_to(end - start))
            length, r = float(np.linalg.norm(end - start)), capsule.radius_m
            half = np.array([r, r, r + 0.5 * length])
            parts.append(_part(joint.link.name, i, pose, half, fcl.Capsule(r, length)))
    last, hand = description.dof - 1, description.gripper
    for box in hand.body:
        pose = description.pose_last_E @ Pose(np.array(box.centre_m))
        parts.append(_part("gripper body", last, pose, np.array(box.half_m), fcl.Box(*(2 * h for h in box.half_m))))
    for name, side in (("left finger", 1.0), ("right finger", -1.0)):
        centre = np.array(hand.finger.centre_m) * [1.0, side, 1.0]
        pose = description.pose_last_E @ hand.pose_E_P @ Pose(centre)
        half = np.array(hand.finger.half_m)
        parts.append(_part(name, last, pose, half, fcl.Box(*(2 * half))))
    return parts


def _rotation_to(direction: Array) -> Array:
    """Return a rotation (3, 3) whose z axis points along `direction`; the identity for a zero vector."""
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        return np.eye(3)
    z = direction / length
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def make_obstacle(name: str, pose: Pose, half_m: Array, shape: fcl.CollisionGeometry) -> Obstacle:
    """Return a fixed shape at a pose in B; `half_m` (3,) are the half sizes of its box in its own frame."""
    body = fcl.CollisionObject(shape, fcl.Transform(np.array(pose.rotation), np.array(pose.position_m)))
    return Obstacle(name, np.array(pose.position_m), np.abs(pose.rotation) @ half_m, body)


def prism(name: str, pose_B_K: Pose, outline_K_m: Array, base_K_m: float, height_m: float) -> Obstacle:
    """Return the upright prism over the convex hull of an outline.

    Args:
        name: Name of the obstacle.
        pose_B_K: Pose of the container.
        outline_K_m: (n, 2) points in K.
        base_K_m: Height of its base above the container floor.
        height_m: Its top above its base.

    Raises:
        ParamError: The outline has no area.
    """
    try:
        corners = outline_K_m[scipy.spatial.ConvexHull(outline_K_m).vertices]  # counter-clockwise
    except (ValueError, scipy.spatial.QhullError):
        raise ParamError(f"obstacle {name}", np.shape(outline_K_m), "an outline (n, 2) that spans an area") from None
    middle, half = 0.5 * (corners.max(axis=0) + corners.min(axis=0)), 0.5 * np.ptp(corners, axis=0)
    n, z = len(corners), np.full((len(corners), 1), 0.5 * height_m)
    vertices = np.concatenate([np.hstack([corners - middle, -z]), np.hstack([corners - middle, z])])
    sides = [[4, i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    faces = np.concatenate([[n, *range(n - 1, -1, -1)], [n, *range(n, 2 * n)], *sides])
    pose = pose_B_K @ Pose(np.array([*middle, base_K_m + 0.5 * height_m]))
    return make_obstacle(name, pose, np.array([*half, 0.5 * height_m]), fcl.Convex(vertices, n + 2, faces))


def world_obstacles(world: World) -> list[Obstacle]:
    """Return the container's floor and walls, the table under it and the holder block."""
    box, t = world.container, world.container.wall_m
    x, y, z = (0.5 * side for side in box.interior_m)
    places = {
        "floor": ((0.0, 0.0, -0.5 * t), (x + t, y + t, 0.5 * t)),
        "wall +x": ((x + 0.5 * t, 0.0, z), (0.5 * t, y + t, z)),
        "wall -x": ((-x - 0.5 * t, 0.0, z), (0.5 * t, y + t, z)),
        "wall +y": ((0.0, y + 0.5 * t, z), (x + t, 0.5 * t, z)),
        "wall -y": ((0.0, -y - 0.5 * t, z), (x + t, 0.5 * t, z)),
    }
    places["table"] = ((0.0, 0.0, -t - _TABLE_HALF_M[2]), _TABLE_HALF_M)
    out = [
        make_obstacle(name, box.pose_B_K @ Pose(np.array(centre)), np.array(half), fcl.Box(*(2 * h for h in half)))
        for name, (centre, half) in places.items()
    ]
    half = np.array(world.holder.half_m)
    below = 0.5 * world.probe.handle_m[2] + HOLDER_GAP_M + half[2]
    pose = world.holder.pose_B_grasp @ Pose(np.array([0.0, 0.0, below]))
    out.append(make_obstacle("holder", pose, half, fcl.Box(*(2 * half))))
    return out


def stowed_probe(world: World) -> Obstacle:
    """Return the handle of the probe in its holder as an obstacle."""
    half = 0.5 * np.array(world.probe.handle_m)
    return make_obstacle("probe", world.holder.pose_B_grasp, half, fcl.Box(*(2 * half)))


def tool_parts(description: RobotDescription, probe: Probe) -> list[MovingPart]:
    """Return tip ball, shaft and handle of the held probe; the centre of its handle is at P."""
    last = description.dof - 1
    hand_pose = description.pose_last_E @ description.gripper.pose_E_P
    half_handle = 0.5 * probe.handle_m[2]
    radius = 0.5 * probe.shaft_diameter_m
    shaft = probe.grasp_to_tip_m - half_handle
    tip = hand_pose @ Pose(np.array([0.0, 0.0, probe.grasp_to_tip_m]))
    middle = hand_pose @ Pose(np.array([0.0, 0.0, half_handle + 0.5 * shaft]))
    return [
        _part("tip", last, tip, np.full(3, probe.tip_radius_m), fcl.Sphere(probe.tip_radius_m)),
        _part("shaft", last, middle, np.array([radius, radius, 0.5 * shaft]), fcl.Cylinder(radius, shaft)),
        _part("handle", last, hand_pose, 0.5 * np.array(probe.handle_m), fcl.Box(*probe.handle_m)),
    ]


def finger_outline_half_m(gripper: Gripper, aperture_m: float) -> Array:
    """Return the half sizes (2,) along x_P and y_P of the rectangle around both fingers at an aperture."""
    outer = gripper.finger.centre_m[1] + gripper.finger.half_m[1]
    return np.array([gripper.finger.half_m[0], outer + 0.5 * aperture_m])
