"""Forward kinematics and Jacobian of a described arm, by chaining its frames (Lynch and Park, Modern Robotics).

The arm takes Cartesian setpoints with their velocity; the seam gives joint ones with a pose. This is the bridge,
and the check that both say the same.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, Pose, RobotDescription


def _fixed(rpy: tuple[float, float, float]) -> Array:
    """(3, 3) of fixed-axis roll, pitch, yaw: Rz Ry Rx."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


class Chain:
    """Kinematics of P, the pads' mid-point.

    Args:
        description: The arm; all joints revolute.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._rotations = [_fixed(j.origin_rpy_rad) for j in description.joints]
        self._origins = [np.array(j.origin_m) for j in description.joints]
        self._axes = [np.array(j.axis) for j in description.joints]
        crosses = [np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) for x, y, z in self._axes]
        self._crosses = [(k, k @ k) for k in crosses]
        self._last_P = description.pose_last_E @ description.gripper.pose_E_P

    def pose_and_twist(self, q: Array, dq: Array) -> tuple[Pose, Array]:
        """Pose of P in B at `q` (dof,) rad, and its twist (6,), linear then angular, in B, for `dq` (dof,) rad/s."""
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
