"""The tool that touches: the probe in the jaws, or the fingers themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import finger_outline_half_m
from glotouch_bt.perception.touch import GuardParams
from glotouch_bt.perception.touch.calibration import UNMEASURED_M_N
from glotouch_bt.perception.touch.detection import Disc, Polygon, Section, section_point
from glotouch_bt.robot import Array, Gripper, Pose, World


@dataclass(frozen=True)
class HeldTool:
    """The probe in the jaws, or the bare fingers.

    Attributes:
        tip_P_m: (3,) reference point in P: centre of the ball, or of the fingers' lower end.
        tip_radius_m: Ball radius; for fingers, radius of the disc of equal area.
        aperture_m: Reported aperture with the handle between the pads.
        yaw_B_rad: Yaw of x_P in B at which the probe was grasped; the hand keeps it while it probes.
        floor_z_K_m: Height of the floor in K as measured with the tip; 0 if registration and grasp are perfect.
            Subtract it from heights measured with this tool.
        section: Planar section about the reference point, in P's x and y; None: the ball's disc.
        latency_s: Estimated age of a wrench sample when it arrives.
        tip_sd_m: Standard deviation of the reference point in P, per planar axis; None if not calibrated.
        corner: (2,) signs in K of the container's corner where the floor was touched; None: the nearest to the holder.
        corner_K_m: (2,) position of the container's corner found by the calibration, in K; None if not calibrated.
        compliance_P_m_N: (2,) displacement of the reference point per force along x_P and y_P; None if not measured,
            which counts as `UNMEASURED_M_N`.
    """

    tip_P_m: Array
    tip_radius_m: float
    aperture_m: float
    yaw_B_rad: float
    floor_z_K_m: float = 0.0
    section: Section | None = None
    latency_s: float = GuardParams().latency_s
    tip_sd_m: float | None = None
    corner: Array | None = None
    corner_K_m: Array | None = None
    compliance_P_m_N: Array | None = None

    @classmethod
    def fingers(cls, gripper: Gripper, aperture_m: float, yaw_B_rad: float) -> HeldTool:
        """Return the bare fingers as a tool.

        Args:
            gripper: The robot's gripper.
            aperture_m: Aperture of the jaws.
            yaw_B_rad: Yaw of x_P in B.
        """
        half = finger_outline_half_m(gripper, aperture_m)
        return cls(
            tip_P_m=np.array([gripper.finger.centre_m[0], 0.0, gripper.fingertip_below_P_m]),
            tip_radius_m=float(np.sqrt(4.0 * half[0] * half[1] / np.pi)),
            aperture_m=aperture_m,
            yaw_B_rad=yaw_B_rad,
            section=Polygon.rectangle(*half),
        )

    @property
    def round(self) -> bool:
        """True if the section is a disc. Outlines are then fitted to its centres, otherwise to contact points."""
        return self.section is None or isinstance(self.section, Disc)

    def tip_K_m(self, world: World, pose_B_P: Pose) -> Array:
        """Return the reference point (3,) in K for a pose of the pads' mid-point in B."""
        return world.container.pose_B_K.inverse().apply(pose_B_P.apply(self.tip_P_m))

    def deflection_K_m(self, world: World, pose_B_P: Pose, force_K_N: Array) -> Array:
        """Return the displacement (3,) in K of the reference point by a force (3,) in K on it; none along z_P."""
        measured = self.compliance_P_m_N
        x, y = (UNMEASURED_M_N, UNMEASURED_M_N) if measured is None else measured.tolist()
        turn = world.container.pose_B_K.rotation.T @ pose_B_P.rotation
        return np.asarray(turn @ (np.array([x, y, 0.0]) * (turn.T @ np.asarray(force_K_N))))

    def contact_point_K_m(self, world: World, pose_B_P: Pose, approach_K: Array, reaction_K: Array | None) -> Array:
        """Return the contact point (2,) in K: the support-plane intercept of the tool's section (paper III-B).

        Args:
            world: The nominal world.
            pose_B_P: Hand pose at the onset.
            approach_K: (2,) or (3,) direction of motion.
            reaction_K: (2,) or (3,) direction of the measured force, or None.
        """
        section = self.section or Disc(self.tip_radius_m)
        axes = (world.container.pose_B_K.rotation.T @ pose_B_P.rotation)[:2, :2]
        reaction = None if reaction_K is None else np.asarray(reaction_K)[:2]
        tip = self.tip_K_m(world, pose_B_P)[:2]
        return section_point(tip, section, axes, np.asarray(approach_K)[:2], reaction)

    def pose_B_P(self, world: World, tip_K_m: Array, yaw_B_rad: float | None = None) -> Pose:
        """Return the downward pose of P that brings the reference point to `tip_K_m` (3,).

        `yaw_B_rad` replaces the yaw of the grasp.
        """
        yaw = self.yaw_B_rad if yaw_B_rad is None else yaw_B_rad
        turned = Pose.pointing_down(world.container.pose_B_K.apply(tip_K_m), yaw)
        return Pose(turned.position_m - turned.rotation @ self.tip_P_m, turned.quat)
