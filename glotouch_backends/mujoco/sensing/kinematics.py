"""Reported pose of P: kinematics of the described arm, while the true arm's joint frames are turned a little."""

from __future__ import annotations

import math

import numpy as np

from glotouch_backends.mujoco.model import BuiltWorld, SensorMap
from glotouch_bt.robot import Array, rpy_to_matrix


class PoseReports:
    """Turn the true pose of P into the pose that the controller computes.

    A joint frame turned by a small e_i (in B) displaces P by e_i x (p - p_i) and turns it by e_i; the sum over the
    joints, to first order (the second is below 1e-6 m for errors of 1 mm), is subtracted.
    """

    def __init__(self, built: BuiltWorld) -> None:
        joints = built.description.joints
        bodies = [built.model.body(j.link.name).id for j in joints]
        self._data, self._bodies = built.data, np.array(bodies)
        self._parents = built.model.body_parentid[bodies]
        errors = built.truth.joint_errors_rad
        self._errors_parent: Array = np.array(
            [rpy_to_matrix(j.origin_rpy_rad) @ e for j, e in zip(joints, errors, strict=True)]
        )[:, :, None]
        self._active = bool(errors.any())

    def correct(self, rows: Array, columns: SensorMap) -> None:
        """Replace position and orientation of P in sensor rows (n, nsensordata) of one period."""
        if not self._active:
            return
        data = self._data
        turns = (data.xmat[self._parents].reshape(-1, 3, 3) @ self._errors_parent)[:, :, 0]
        turn = turns.sum(axis=0)
        position = rows[:, columns.position]
        x, y, z = turn.tolist()
        # sum of e_i x (p - p_i)
        shift = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ position[-1]
        moment = data.xpos[self._bodies].T @ turns  # (3, 3): sum of p_i e_i
        shift -= (moment[2, 1] - moment[1, 2], moment[0, 2] - moment[2, 0], moment[1, 0] - moment[0, 1])
        position -= shift
        a, b, c = -0.5 * x, -0.5 * y, -0.5 * z
        w = math.sqrt(1.0 - a * a - b * b - c * c)
        left = np.array([[w, -a, -b, -c], [a, w, -c, b], [b, c, w, -a], [c, -b, a, w]])
        rows[:, columns.quat] = rows[:, columns.quat] @ left.T
