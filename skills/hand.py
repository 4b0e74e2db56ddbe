"""The open hand: parallel jaws look the same after half a turn, so of two yaws the arm takes the easier one."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Arm
from glotouch_bt.robot import Array, Container, MotionRefused, Pose


def easy_yaw(arm: Arm, yaw_B_rad: float) -> float:
    """Of `yaw_B_rad` and its half turns, the one nearest to the arm's home yaw (far from the last joint's stops)."""
    home_yaw = arm.kinematics.fk(arm.kinematics.home).yaw_rad
    away = (yaw_B_rad - home_yaw + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return float(home_yaw + away)


def hand_pose_B(arm: Arm, container: Container, position_K_m: Array, yaw_K_rad: float) -> Pose:
    """Pose of P in B, pointing down at `position_K_m` (3,) with x_P along `yaw_K_rad` or its half turn."""
    yaw_B = easy_yaw(arm, container.pose_B_K.yaw_rad + yaw_K_rad)
    return Pose.pointing_down(container.pose_B_K.apply(position_K_m), yaw_B)


def require_clear(arm: Arm, pose_B_P: Pose, aperture_m: float) -> None:
    """Make sure that the open hand has room at a pose before anything moves towards it.

    Raises:
        MotionRefused: Out of reach, or some part would hit something; the pair is named.
    """
    q = arm.kinematics.ik(pose_B_P, arm.q)
    blocked = arm.scene.why_blocked(q, aperture_m)
    if blocked is not None:
        raise MotionRefused("pose", blocked)
