"""Robot, container, stand and probe as coloured solids in a tree of frames. Pure: numbers in, meshes out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from glotouch_bt.lazy import lazy_module
from glotouch_bt.report.state import FittedTarget, GhostObject, OutlineState, RunSetup
from glotouch_bt.robot import Array, Box, Capsule, Holder, Pose, Probe, RobotDescription, matrix_to_quat, rpy_to_matrix
from glotouch_bt.robot.scene import standing

if TYPE_CHECKING:
    import trimesh
else:
    trimesh = lazy_module("trimesh")

Colour = tuple[int, int, int]

HOUSING: Colour = (226, 229, 233)
JOINT: Colour = (92, 102, 116)
HAND: Colour = (88, 97, 112)
FINGER: Colour = (126, 134, 146)
GEL: Colour = (240, 140, 50)
STEEL: Colour = (176, 184, 196)
HANDLE: Colour = (38, 90, 166)
STAND: Colour = (120, 124, 128)
FLOOR: Colour = (222, 210, 190)
WALL: Colour = (200, 184, 158)
TABLE: Colour = (243, 244, 246)
STATE_COLOURS: dict[OutlineState, Colour] = {
    "found": (37, 103, 201),
    "best": (22, 131, 74),
    "excluded": (98, 106, 118),
    "rejected": (197, 53, 43),
    "taken": (138, 85, 199),
}
"""Colour of a candidate by its state; the page's words have the same colours."""
TOUCH: Colour = (206, 30, 12)
PLAN: Colour = (200, 20, 140)
GHOST: Colour = (0, 158, 190)
FIT: Colour = (22, 131, 74)
TOUCH_RADIUS_M = 0.0028
"""Radius of a contact's ball. Source: ours, for drawing only."""
REACTION_M = 0.014
"""Length of the line along the force of a contact. Source: ours, for drawing only."""
SDS = 2.0
"""Half width of an outline's band in standard deviations: 95 % of a normal distribution."""
MIN_BAND_M = 0.0004
"""Smallest half width of a band, so that it can be seen. Source: ours, for drawing only."""
MIN_HEIGHT_M = 0.004
"""Smallest height of a prism. Source: ours, for drawing only."""
RING_M = 0.004
"""Height by which the ring at a joint stands out of its housing. Source: ours."""
GEL_M = 0.002
"""Thickness of a pad. Source: ours, as in the simulation."""


@dataclass(frozen=True)
class Solid:
    """A coloured mesh in one frame: vertices (n, 3) m, faces (m, 3), opacity 0..1; `smooth` if it has no edges."""

    frame: str
    name: str
    vertices_m: Array
    faces: npt.NDArray[np.int64]
    colour: Colour
    opacity: float = 1.0
    smooth: bool = False


def joint_frames(description: RobotDescription) -> list[str]:
    """Return the names of the frames of the joints, each inside the one before: arm/1, arm/1/2, ..."""
    numbers = [str(i + 1) for i in range(description.dof)]
    return ["arm/" + "/".join(numbers[: i + 1]) for i in range(len(numbers))]


def joint_poses(description: RobotDescription, q: Array) -> list[Pose]:
    """Return the pose of each joint's frame in the frame before it (the first in B), at joint positions (dof,), rad."""
    poses = []
    for joint, angle in zip(description.joints, q.tolist(), strict=True):
        fixed = Pose(np.array(joint.origin_m), matrix_to_quat(rpy_to_matrix(joint.origin_rpy_rad)))
        half = 0.5 * angle
        turn = Pose(np.zeros(3), np.array([math.cos(half), *(math.sin(half) * np.array(joint.axis))]))
        poses.append(fixed @ turn)
    return poses


def finger_shift_m(aperture_m: float, side: float) -> tuple[float, float, float]:
    """Return the position of a finger's frame in P: the left finger (side 1) is at +y_P, the right one (-1) at -y_P."""
    return (0.0, side * 0.5 * aperture_m, 0.0)


def robot_solids(description: RobotDescription, sections: int = 32) -> list[Solid]:
    """Return the solids of base, links, hand and fingers; `sections` is the number of corners of a circle.

    Frames: "base" is B; those of `joint_frames`; "hand" is E; "left" and "right" are P moved by `finger_shift_m`.
    """
    solids = [_capsule("base", f"housing{i}", c, HOUSING, sections) for i, c in enumerate(description.base.capsules)]
    for frame, joint in zip(joint_frames(description), description.joints, strict=True):
        solids += [_capsule(frame, f"housing{i}", c, HOUSING, sections) for i, c in enumerate(joint.link.capsules)]
        radius = max((c.radius_m for c in joint.link.capsules), default=0.04)
        ring = trimesh.creation.cylinder(radius + RING_M, 0.05, sections=2 * sections)
        z = np.array([0.0, 0.0, 1.0])
        ring.apply_transform(trimesh.geometry.align_vectors(z, np.array(joint.axis)))
        solids.append(_solid(frame, "ring", ring, JOINT))
    hand = description.gripper
    solids += [_box("hand", f"body{i}", b, HAND) for i, b in enumerate(hand.body)]
    x, y, z_m = hand.finger.centre_m
    for frame, side in (("left", 1.0), ("right", -1.0)):
        hx, hy, hz = hand.finger.half_m
        back = Box(centre_m=(x, side * (y + 0.5 * GEL_M), z_m), half_m=(hx, hy - 0.5 * GEL_M, hz))
        width, length = hand.pad_window_m
        gel = Box(centre_m=(0.0, side * 0.5 * GEL_M, 0.0), half_m=(0.5 * width, 0.5 * GEL_M, 0.5 * length))
        solids += [_box(frame, "finger", back, FINGER), _box(frame, "gel", gel, GEL)]
    return solids


def probe_solids(probe: Probe) -> list[Solid]:
    """Return the solids of the probe in the frame "probe": the handle's centre, z to the ball."""
    handle = trimesh.creation.box(probe.handle_m)
    shaft = trimesh.creation.cylinder(0.5 * probe.shaft_diameter_m, probe.grasp_to_tip_m, sections=24)
    shaft.apply_translation((0.0, 0.0, 0.5 * probe.grasp_to_tip_m))
    ball = trimesh.creation.icosphere(2, probe.tip_radius_m)
    ball.apply_translation((0.0, 0.0, probe.grasp_to_tip_m))
    return [
        _solid("probe", "handle", handle, HANDLE),
        _solid("probe", "shaft", shaft, STEEL),
        _solid("probe", "ball", ball, STEEL),
    ]


def stand_solids(holder: Holder, probe: Probe, height_m: float) -> list[Solid]:
    """Return the probe's stand in the frame "stand": the grasp pose of the stowed probe, z down.

    Args:
        holder: The stand's block.
        probe: The probe in it.
        height_m: Height of the frame above the table; two posts reach down to it. Their shape is not known.
    """
    x, y, z = holder.half_m
    top = 0.5 * probe.handle_m[2]
    sides = [Box(centre_m=(s * 0.75 * x, 0.0, top + z), half_m=(0.25 * x, y, z)) for s in (-1.0, 1.0)] + [
        Box(centre_m=(0.0, s * 0.85 * y, top + z), half_m=(0.5 * x, 0.15 * y, z)) for s in (-1.0, 1.0)
    ]
    foot = top + 2.0 * z
    if height_m > foot:
        post = 0.5 * (height_m - foot)
        sides += [Box(centre_m=(s * 0.8 * x, 0.0, foot + post), half_m=(0.004, 0.8 * y, post)) for s in (-1.0, 1.0)]
    return [_box("stand", f"side{i}", b, STAND) for i, b in enumerate(sides)]


def world_solids(setup: RunSetup) -> list[Solid]:
    """Return table, pedestal, container and stand: frames "base" (B), "K" and "stand" (`stand_solids`)."""
    container, holder, K = setup.container, setup.holder, setup.pose_B_K.position_m
    table_m = float(K[2]) - (0.008 if container is None else container.wall_m)
    middle = (0.5 * float(K[0]), 0.5 * float(K[1]), table_m - 0.003)
    solids = [_box("base", "table", Box(centre_m=middle, half_m=(0.75, 0.65, 0.003)), TABLE)]
    if table_m < 0.0:  # the base stands on something; its shape is not known
        pedestal = trimesh.creation.cylinder(0.09, -table_m, sections=40)
        pedestal.apply_translation((0.0, 0.0, 0.5 * table_m))
        solids.append(_solid("base", "pedestal", pedestal, STAND))
    if container is not None:
        x, y, z = (0.5 * v for v in container.interior_m)
        t = 0.5 * container.wall_m
        floor = Box(centre_m=(0.0, 0.0, -t), half_m=(x + 2 * t, y + 2 * t, t))
        solids.append(_box("K", "floor", floor, FLOOR))
        walls = [Box(centre_m=(s * (x + t), 0.0, z), half_m=(t, y + 2 * t, z)) for s in (1.0, -1.0)] + [
            Box(centre_m=(0.0, s * (y + t), z), half_m=(x, t, z)) for s in (1.0, -1.0)
        ]
        solids += [replace(_box("K", f"wall{i}", wall, WALL), opacity=0.28) for i, wall in enumerate(walls)]
    if holder is not None and setup.probe is not None:
        solids += stand_solids(holder, setup.probe, float(holder.pose_B_grasp.position_m[2]) - table_m)
    return solids


def rim(setup: RunSetup) -> Array:
    """Return the upper edge of the container's interior (5, 3) in K, closed; (0, 3) without a container."""
    if setup.container is None:
        return np.zeros((0, 3))
    x, y, z = setup.container.interior_m
    return np.array([(a * x / 2, b * y / 2, z) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))])


def true_mesh(body: GhostObject, setup: RunSetup) -> tuple[Array, npt.NDArray[np.int64]] | None:
    """Return vertices and faces of a true object in its mesh frame, at its true size; None if its file is unknown."""
    mesh = setup.mesh(body.name)
    if mesh is None:
        return None
    scale = np.ones(3) if body.size_m is None else body.size_m / np.maximum(mesh.extents_m, 1e-9)
    return mesh.vertices_m * scale, mesh.faces


def fitted_mesh(fit: FittedTarget, setup: RunSetup) -> tuple[Array, npt.NDArray[np.int64]] | None:
    """Return vertices in K and faces of the target at its fitted pose; None if its file is unknown."""
    mesh = setup.mesh(fit.name)
    if mesh is None:
        return None
    x, y, yaw = fit.pose_K_O
    pose = Pose.planar([x, y, 0.0], yaw)
    return pose.apply(standing(mesh, fit.quat).vertices_m), mesh.faces


def prism(outline_m: Array, height_m: float) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return the wall of an upright prism over a closed polyline (n, 2), from 0 to a height, without lids."""
    n = len(outline_m)
    low, high = np.zeros((n, 1)), np.full((n, 1), height_m)
    return _strip(np.hstack([outline_m, low]), np.hstack([outline_m, high]))


def band(outline_m: Array, across_m: Array, height_m: float) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return a flat ring around a closed polyline (n, 2): `across_m` (n, 2) to each side, at a height."""
    z = np.full((len(outline_m), 1), height_m)
    return _strip(np.hstack([outline_m - across_m, z]), np.hstack([outline_m + across_m, z]))


def _strip(one: Array, other: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return the surface between two polylines (n, 3)."""
    n = len(one)
    i = np.arange(n - 1)
    quads = np.stack([i, i + 1, n + i + 1, n + i], axis=1)
    return np.concatenate([one, other]), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _solid(frame: str, name: str, mesh: trimesh.Trimesh, colour: Colour) -> Solid:
    return Solid(frame, name, np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64), colour)


def _box(frame: str, name: str, box: Box, colour: Colour) -> Solid:
    mesh = trimesh.creation.box([2.0 * h for h in box.half_m])
    mesh.apply_translation(box.centre_m)
    return _solid(frame, name, mesh, colour)


def _capsule(frame: str, name: str, capsule: Capsule, colour: Colour, sections: int) -> Solid:
    start, end = np.array(capsule.start_m), np.array(capsule.end_m)
    length = float(np.linalg.norm(end - start))
    mesh = trimesh.creation.capsule(length, capsule.radius_m, count=[sections, sections])
    if length > 0.0:
        mesh.apply_transform(trimesh.geometry.align_vectors(np.array([0.0, 0.0, 1.0]), (end - start) / length))
    mesh.apply_translation(0.5 * (start + end))  # trimesh centres a capsule on the origin
    return replace(_solid(frame, name, mesh, colour), smooth=True)
