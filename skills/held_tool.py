"""What the hand knows about the probe it holds."""

from __future__ import annotations

from dataclasses import dataclass

from glotouch_bt.robot import Array, Pose, World


@dataclass(frozen=True)
class HeldTool:
    """The probe in the jaws.

    Attributes:
        tip_P_m: (3,) centre of the ball in P.
        tip_radius_m: Ball radius.
        shaft_radius_m: Shaft radius.
        aperture_m: Reported aperture with the handle between the pads.
        yaw_B_rad: Yaw of x_P in B at which the probe was grasped; the hand keeps it while it probes.
        floor_z_K_m: Height of the floor in K as the tip felt it; 0 if registration and grasp were perfect.
            Heights measured with this tool subtract it.
    """

    tip_P_m: Array
    tip_radius_m: float
    shaft_radius_m: float
    aperture_m: float
    yaw_B_rad: float
    floor_z_K_m: float = 0.0

    def tip_K_m(self, world: World, pose_B_P: Pose) -> Array:
        """(3,) centre of the ball in K for a pose of the pads' mid-point in B."""
        return world.container.pose_B_K.inverse().apply(pose_B_P.apply(self.tip_P_m))

    def pose_B_P(self, world: World, tip_K_m: Array) -> Pose:
        """Pose of the pads' mid-point that brings the ball's centre to `tip_K_m` (3,), the hand pointing down."""
        turned = Pose.pointing_down(world.container.pose_B_K.apply(tip_K_m), self.yaw_B_rad)
        return Pose(turned.position_m - turned.rotation @ self.tip_P_m, turned.quat)
