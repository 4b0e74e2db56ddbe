"""The arm controller's inverse kinematics: the nearest posture with the pose, pulled to a reference posture."""

from __future__ import annotations

import mujoco
import numpy as np

from glotouch_backends.mujoco.model import Handles
from glotouch_bt.robot import Array, Pose

MAX_ITERATIONS = 30
"""Iterations before a pose counts as out of reach."""
TOLERANCE = 1e-8
"""Tolerated error of the pose, m and rad."""
DAMPING = 1e-8
"""Damping of the pseudo-inverse."""
NULL_RATE_PER_S = 2.0
"""Rate of the pull to the reference posture. ASSUMED."""


def rotation_between(goal: Array, now: Array) -> Array:
    """Return the rotation vector (3,) that turns the rotation matrix `now` into `goal`, in their common frame."""
    m = goal @ now.T
    axis = 0.5 * np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    sine, cosine = float(np.linalg.norm(axis)), 0.5 * (float(np.trace(m)) - 1.0)
    if sine < 1e-9:
        return axis
    return np.asarray(axis * (np.arctan2(sine, cosine) / sine))


class ControllerKinematics:
    """Kinematics of P on a private copy of the world.

    Args:
        model, handles: The world.
    """

    def __init__(self, model: mujoco.MjModel, handles: Handles) -> None:
        self._model, self._h = model, handles
        self._data = mujoco.MjData(model)
        self._all = np.zeros((6, model.nv))

    def at(self, q: Array) -> tuple[Array, Array, Array]:
        """Return position (3,), rotation (3, 3) of P in B and its Jacobian (6, dof), linear over angular, at `q`."""
        h, d = self._h, self._data
        d.qpos[h.arm_qpos] = q
        mujoco.mj_kinematics(self._model, d)
        mujoco.mj_comPos(self._model, d)
        mujoco.mj_jacSite(self._model, d, self._all[:3], self._all[3:], h.pads_site)
        return (
            np.array(d.site_xpos[h.pads_site]),
            np.array(d.site_xmat[h.pads_site]).reshape(3, 3),
            self._all[:, h.arm_dof].copy(),
        )

    def solve(self, pose_B_P: Pose, q: Array, reference: Array, time_s: float) -> tuple[Array, Array] | None:
        """Return the posture (dof,) near `q` with the pose, and its Jacobian (6, dof); None if it is out of reach.

        Args:
            pose_B_P: Goal pose of P.
            q: (dof,) start.
            reference: (dof,) reference posture of the redundant joint.
            time_s: Duration of the pull to it.
        """
        _, _, j = self.at(q)
        wish = (reference - q) * (1.0 - np.exp(-NULL_RATE_PER_S * time_s))
        q = q + wish - inverse(j) @ (j @ wish)
        for _ in range(MAX_ITERATIONS):
            position, rotation, j = self.at(q)
            error = np.concatenate([pose_B_P.position_m - position, rotation_between(pose_B_P.rotation, rotation)])
            if float(np.abs(error).max()) < TOLERANCE:
                return q, j
            step = inverse(j) @ error
            q = q + step * min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-12))
        return None


def inverse(j: Array) -> Array:
    """Return the damped pseudo-inverse (dof, 6) of a Jacobian (6, dof)."""
    return np.asarray(j.T @ np.linalg.inv(j @ j.T + DAMPING * np.eye(6)))
