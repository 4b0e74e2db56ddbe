"""Pose of the downward hand at a place in the container."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion.arm import Arm
from glotouch_bt.robot import Array, Container, Pose


def yaw_near_home(arm: Arm, yaw_B_rad: float) -> float:
    """Return `yaw_B_rad` or its half turn, whichever is nearer to the arm's home yaw.

    Parallel jaws look the same after half a turn. Near the home yaw, the last joint is far from its stops.
    """
    home_yaw = arm.kinematics.fk(arm.kinematics.home).yaw_rad
    away = (yaw_B_rad - home_yaw + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    return float(home_yaw + away)


def hand_pose_B(arm: Arm, container: Container, position_K_m: Array, yaw_K_rad: float) -> Pose:
    """Return the pose of P in B, pointing down at `position_K_m` (3,), x_P along `yaw_K_rad` or its half turn."""
    yaw_B = yaw_near_home(arm, container.pose_B_K.yaw_rad + yaw_K_rad)
    return Pose.pointing_down(container.pose_B_K.apply(position_K_m), yaw_B)
