"""The robot as numbers: kinematics, inertia, limits, collision capsules and the gripper. No backend, no solver.

Simulator and planner are built from the same description.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from glotouch_bt.errors import ParamError
from glotouch_bt.robot.geometry import Array, Pose, cross_matrix, rpy_to_matrix

Vec3 = tuple[float, float, float]
MIN_LIGHT_VOLUME = 0.05
"""Least volume spanned by the directions of a gel's three lights; below it a surface's slope does not follow from its
colour. Source: ours; lights 120 deg apart span 0.8 at an elevation of 20 deg and 0.08 at 80 deg."""


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """A collision capsule in its link's frame: the segment `start_m`..`end_m` swept by a ball of `radius_m`."""

    start_m: Vec3
    end_m: Vec3
    radius_m: float


@dataclass(frozen=True, kw_only=True)
class Link:
    """One rigid link.

    Attributes:
        name: Link name.
        mass_kg: Mass.
        com_m: Centre of mass in the link frame.
        inertia_kgm2: (ixx, iyy, izz, ixy, ixz, iyz) about the centre of mass, in the link frame's axes.
        capsules: Collision shape in the link frame.
    """

    name: str
    mass_kg: float
    com_m: Vec3
    inertia_kgm2: tuple[float, float, float, float, float, float]
    capsules: tuple[Capsule, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A revolute joint and the link it carries.

    Attributes:
        name: Joint name.
        origin_m: Joint frame's origin in the parent link's frame.
        origin_rpy_rad: Fixed-axis roll, pitch, yaw of the joint frame in the parent's.
        axis: Unit axis in the joint frame.
        lower_rad, upper_rad: Position range.
        velocity_rad_s: Velocity limit.
        torque_Nm: Torque limit.
        armature_kgm2: Reflected rotor inertia.
        link: The link it moves; the link frame is the joint frame.
        servo_stiffness_Nm_rad: Stiffness of its position servo; 0 if unknown. Only a simulated arm needs it.
    """

    name: str
    origin_m: Vec3
    origin_rpy_rad: Vec3
    axis: Vec3
    lower_rad: float
    upper_rad: float
    velocity_rad_s: float
    torque_Nm: float
    armature_kgm2: float
    link: Link
    servo_stiffness_Nm_rad: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Box:
    """An axis-aligned box in a named frame: centre and half sizes, m."""

    centre_m: Vec3
    half_m: Vec3


@dataclass(frozen=True, kw_only=True)
class GelCamera:
    """The camera behind each gel: colour images of the gel's surface, lit by a red, a green and a blue light.

    Attributes:
        shape: (rows, cols) of an image, laid out as a depth map.
        lights: Unit directions towards the red, the green and the blue light, each (along the columns, along the rows,
            out of the object into the gel), in the LEFT image. Both sensors are mounted alike, so the lights of the
            right image are mirrored along its columns.
    """

    shape: tuple[int, int]
    lights: tuple[Vec3, Vec3, Vec3]

    def __post_init__(self) -> None:
        if min(self.shape) < 1:
            raise ParamError("camera.shape", self.shape, "positive")
        if not abs(float(np.linalg.det(np.array(self.lights)))) > MIN_LIGHT_VOLUME:
            raise ParamError("camera.lights", self.lights, "three directions that span the space")

    def directions(self, *, right: bool) -> Array:
        """Return the light directions (3, 3) of one pad's image, one row a light."""
        return np.array(self.lights) * [-1.0 if right else 1.0, 1.0, 1.0]


@dataclass(frozen=True, kw_only=True)
class Gripper:
    """A parallel gripper with a gel pad on each finger. Frame P as in `observation`.

    Attributes:
        pose_E_P: Pads' mid-point in the flange frame.
        mass_kg, com_E_m: Gripper body without the fingers, centre of mass in E.
        finger_mass_kg: One finger.
        stroke_m, force_N, speed_m_s: Largest aperture, jaw force and aperture rate.
        body: Collision boxes of the body, in E.
        finger: Collision box of the LEFT finger in P when the jaws are closed (its pad surface at y = 0, extending to
            +y); the right finger is its mirror image in y. At aperture w each is moved outwards by w/2.
        pad_window_m: (width along x_P, length along z_P) of the gel.
        pad_shape: (rows, cols) of the depth map.
        pad_depth_m: Largest indentation the gel can show.
        camera: Camera behind each gel, or None if the pads give depth maps only.
    """

    pose_E_P: Pose
    mass_kg: float
    com_E_m: Vec3
    finger_mass_kg: float
    stroke_m: float
    force_N: float
    speed_m_s: float
    body: tuple[Box, ...]
    finger: Box
    pad_window_m: tuple[float, float]
    pad_shape: tuple[int, int]
    pad_depth_m: float
    camera: GelCamera | None = None

    def mass_and_com_E(self) -> tuple[float, Array]:
        """Return mass kg and centre of mass (3,) in E of the body with both fingers."""
        (x, _, z), fingers = self.finger.centre_m, 2 * self.finger_mass_kg
        centre = self.pose_E_P.apply((x, 0.0, z))
        mass = self.mass_kg + fingers
        return mass, (self.mass_kg * np.asarray(self.com_E_m) + fingers * centre) / mass

    @property
    def image_pitch_m(self) -> tuple[float, float]:
        """Distance of two pixels of a gel image (along its rows' axis z_P, along x_P).

        Raises:
            ParamError: The gripper has no camera.
        """
        if self.camera is None:
            raise ParamError("gripper.camera", None, "a gripper whose pads give images")
        return self.pad_window_m[1] / self.camera.shape[0], self.pad_window_m[0] / self.camera.shape[1]

    @property
    def fingertip_below_P_m(self) -> float:
        """Distance from P to the fingertips along z_P."""
        return self.finger.centre_m[2] + self.finger.half_m[2]


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """One arm with one gripper.

    Attributes:
        name: Model name.
        base: The fixed base link, in B.
        joints: The chain from B to the last link.
        pose_last_E: Flange frame in the last joint's frame.
        home_q: Posture well inside the limits with the hand pointing down; also the target of the posture task.
        gripper: The hand.
        source: Origin of the numbers.
        wrist_feels_inertia: The wrist's force contains the inertia of the moving hand. False only without physics.
    """

    name: str
    base: Link
    joints: tuple[Joint, ...]
    pose_last_E: Pose
    home_q: tuple[float, ...]
    gripper: Gripper
    source: str = field(default="")
    wrist_feels_inertia: bool = True

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joints)


def forward(description: RobotDescription, q: npt.ArrayLike) -> Pose:
    """Return the pose of P in B at `q` (dof,) rad by chaining the description's frames."""
    pose = Pose(np.zeros(3))
    for joint, angle in zip(description.joints, np.asarray(q, dtype=np.float64), strict=True):
        turn = rpy_to_matrix(joint.origin_rpy_rad) @ _about(joint.axis, float(angle))
        pose = pose @ Pose.from_matrix(joint.origin_m, turn)
    return pose @ description.pose_last_E @ description.gripper.pose_E_P


def _about(axis: tuple[float, float, float], angle: float) -> Array:
    """Return the rotation matrix (3, 3) about a unit axis (Rodrigues)."""
    k = cross_matrix(axis)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k), dtype=np.float64)
