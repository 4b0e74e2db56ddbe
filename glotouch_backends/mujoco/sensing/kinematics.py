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
        joints, errors = built.description.joints, built.truth.joint_errors_rad
        first = int(built.model.body(joints[0].link.name).id)  # the links are numbered along the chain, after the base
        self._active = bool(errors.any())
        self._rotations = built.data.xmat[first - 1 : first - 1 + len(joints)].reshape(-1, 3, 3)
        self._origins = built.data.xpos[first : first + len(joints)]
        self._errors_parent: Array = np.array(
            [rpy_to_matrix(j.origin_rpy_rad) @ e for j, e in zip(joints, errors, strict=True)]
        )[:, None, :]

    def correct(self, rows: Array, columns: SensorMap) -> None:
        """Replace position and orientation of P in sensor rows (n, nsensordata) of one period."""
        if not self._active:
            return
        turns = (self._rotations * self._errors_parent).sum(axis=2)  # e_i in B
        ((_, mxy, mxz), (myx, _, myz), (mzx, mzy, _)) = (self._origins.T @ turns).tolist()  # sum of p_i e_i
        x, y, z = turns.sum(axis=0).tolist()
        px, py, pz = rows[-1, columns.position].tolist()
        # the sum of e_i x (p - p_i) is (sum of e_i) x p + sum of p_i x e_i
        rows[:, columns.position] -= (
            y * pz - z * py + myz - mzy,
            z * px - x * pz + mzx - mxz,
            x * py - y * px + mxy - myx,
        )
        a, b, c = -0.5 * x, -0.5 * y, -0.5 * z
        w = math.sqrt(1.0 - a * a - b * b - c * c)
        left = np.array(((w, -a, -b, -c), (a, w, -c, b), (b, c, w, -a), (c, -b, a, w)))
        rows[:, columns.quat] = rows[:, columns.quat] @ left.T
