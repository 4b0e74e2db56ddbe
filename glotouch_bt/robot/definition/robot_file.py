"""The YAML file of a robot: what a URDF does not say. Every key has a description; the reference page lists them."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]
PositiveVec3 = tuple[Positive, Positive, Positive]


class RobotFileSection(BaseModel):
    """A mapping in the file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


class JointSection(RobotFileSection):
    """One joint of the URDF, by its name there."""

    home_rad: float = Field(description="position at home, rad")
    armature_kgm2: float = Field(ge=0.0, description="inertia of motor and gear as seen at the joint, kg m2")
    servo_stiffness_Nm_rad: float = Field(gt=0.0, description="stiffness of the joint's position servo, Nm/rad")


class CapsuleSection(RobotFileSection):
    """A collision capsule in its link's frame; see `robot.Capsule`."""

    start_m: Vec3 = Field(description="one end of its axis, m, in the link's frame")
    end_m: Vec3 = Field(description="other end of its axis, m; equal to start_m for a ball")
    radius_m: float = Field(gt=0.0, description="radius, m")


class PadFrameSection(RobotFileSection):
    """Frame P in the flange frame E."""

    position_m: Vec3 = Field(description="origin of P in E, m")
    yaw_deg: float = Field(default=0.0, description="rotation of P about z_E; z_P points along z_E, away from the arm")


class BoxSection(RobotFileSection):
    """An axis-aligned box; see `robot.Box`."""

    centre_m: Vec3 = Field(description="centre, m")
    half_m: PositiveVec3 = Field(description="half sizes, m")


class GelCameraSection(RobotFileSection):
    """The camera behind each gel; see `robot.GelCamera`."""

    shape: tuple[Annotated[int, Field(ge=14, le=1000)], Annotated[int, Field(ge=10, le=1000)]] = Field(
        description="rows and columns of an image"
    )
    azimuth_deg: Vec3 = Field(
        description="directions of the red, green and blue light in the left image, deg from its columns to its rows"
    )
    elevation_deg: float = Field(ge=5.0, le=80.0, description="angle of the lights above the gel's surface, deg")


class GripperSection(RobotFileSection):
    """A parallel gripper with a gel pad on each finger; see `robot.Gripper`."""

    pose_E_P: PadFrameSection = Field(description="pads' mid-point P in E: z along the approach, y along closing")
    mass_kg: float = Field(gt=0.0, description="mass of the body without the fingers, kg")
    com_E_m: Vec3 = Field(description="centre of mass of the body in E, m")
    finger_mass_kg: float = Field(gt=0.0, description="mass of one finger, kg")
    stroke_m: float = Field(gt=0.0, le=1.0, description="largest opening between the pads, m")
    force_N: float = Field(gt=0.0, description="largest force of the jaws, N")
    speed_m_s: float = Field(gt=0.0, description="largest rate of the opening, m/s")
    body: tuple[BoxSection, ...] = Field(min_length=1, description="collision boxes of the body, in E")
    finger: BoxSection = Field(
        description="collision box of the left finger in P with closed jaws, its pad at y = 0; the right one mirrors it"
    )
    pad_window_m: tuple[Positive, Positive] = Field(description="size of a gel pad along x_P and z_P, m")
    pad_shape: tuple[Annotated[int, Field(ge=2)], Annotated[int, Field(ge=2)]] = Field(
        description="rows and columns of a depth map"
    )
    pad_depth_m: float = Field(gt=0.0, description="largest indentation that a pad can show, m")
    camera: GelCameraSection | None = Field(
        default=None, description="camera behind each gel; without one, the pads give depth maps only"
    )


class RobotFile(RobotFileSection):
    """A robot's file."""

    robot: str = Field(min_length=1, description="name of the robot; runs and reports state it")
    source: str = Field(description="origin of the numbers")
    urdf: str = Field(description="path of the URDF, relative to this file")
    base: str = Field(description="link of the URDF that stands still; its frame is B, with z up")
    flange: str = Field(description="link of the URDF that carries the gripper; its frame is E")
    joints: dict[str, JointSection] = Field(description="every moving joint from base to flange, by its name")
    capsules: dict[str, tuple[CapsuleSection, ...]] = Field(
        description="collision capsules of the base and of every moving link, by the link's name; [] for none"
    )
    gripper: GripperSection = Field(description="the hand")
