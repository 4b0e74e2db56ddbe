"""Forward kinematics and Jacobian of a described arm (Lynch and Park, Modern Robotics).

The arm needs Cartesian setpoints with a twist, while our commands are joint setpoints with a pose. The chain gives the
twist, and checks that joints and pose agree.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, Pose, RobotDescription, cross_matrix, rpy_to_matrix


class Chain:
    """Kinematics of P, the pads' mid-point.

    Args:
        description: The arm; all joints revolute.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._rotations = [rpy_to_matrix(j.origin_rpy_rad) for j in description.joints]
        self._origins = [np.array(j.origin_m) for j in description.joints]
        self._axes = [np.array(j.axis) for j in description.joints]
        crosses = [cross_matrix(axis) for axis in self._axes]
        self._crosses = [(k, k @ k) for k in crosses]
        self._last_P = description.pose_last_E @ description.gripper.pose_E_P

    def pose_and_twist(self, q: Array, dq: Array) -> tuple[Pose, Array]:
        """Return pose of P at `q` (dof,) rad and its twist (6,) at `dq` (dof,) rad/s, linear then angular; in B."""
        rotation, origin = np.eye(3), np.zeros(3)
        sines, cosines = np.sin(q).tolist(), (1.0 - np.cos(q)).tolist()
        points, axes = [], []
        for i, (fixed, offset) in enumerate(zip(self._rotations, self._origins, strict=True)):
            origin = origin + rotation @ offset
            rotation = rotation @ fixed
            points.append(origin)
            axes.append(rotation @ self._axes[i])
            k, kk = self._crosses[i]
            rotation = rotation + rotation @ (sines[i] * k + cosines[i] * kk)
        tip = Pose.from_matrix(origin + rotation @ self._last_P.position_m, rotation @ self._last_P.rotation)
        axis = np.array(axes)
        linear = np.cross(axis, tip.position_m - np.array(points))
        return tip, np.concatenate([dq @ linear, dq @ axis])
