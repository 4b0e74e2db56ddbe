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
        floor_z_K_m: Height of the floor in K as the tip felt it; 0 if the registration were exact and the grasp perfect.
            Heights measured with this tool subtract it.
    """

    tip_P_m: Array
    tip_radius_m: float
    shaft_radius_m: float
    aperture_m: float
    floor_z_K_m: float = 0.0

    def tip_K_m(self, world: World, pose_B_P: Pose) -> Array:
        """(3,) centre of the ball in K for a pose of the pads' mid-point in B."""
        return world.container.pose_B_K.inverse().apply(pose_B_P.apply(self.tip_P_m))

    def pose_B_P(self, world: World, tip_K_m: Array, yaw_K_rad: float = 0.0) -> Pose:
        """Pose of the pads' mid-point that brings the ball's centre to `tip_K_m` (3,), the hand pointing down."""
        pose_B_K = world.container.pose_B_K
        turned = Pose.pointing_down(pose_B_K.apply(tip_K_m), pose_B_K.yaw_rad + yaw_K_rad)
        return Pose(turned.position_m - turned.rotation @ self.tip_P_m, turned.quat)
