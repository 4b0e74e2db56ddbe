"""Round observations to the steps of the record before skills see them, so that a replay gets the same numbers.

Each step is far below the noise of its sensor (nominal: 0.05 N, 0.1 mm of aperture, micrometres of gel depth).
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, GelImages, GripperState, Observation, TactileFrame

# Rounding step of each quantity, in the unit of its name.
STAMP_S = 1e-7
JOINT_RAD = 1e-7
JOINT_RAD_S = 1e-6
POSITION_M = 1e-7
QUATERNION = 1e-8
FORCE_N = 1e-4
TORQUE_NM = 1e-5
APERTURE_M = 1e-7
SPEED_M_S = 1e-6
DEPTH_M = 1e-6


def to_step(values: Array, step: float) -> Array:
    """Round to multiples of `step` with the arithmetic of `mcap_packing`, so that packing loses nothing."""
    rounded: Array = np.rint(values * (1.0 / step)) * step
    return rounded


@compiled(
    "given f8[:]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "f8[:, ::1]",
)
def _rounded(stamp: Array, q: Array, dq: Array, position: Array, quat: Array, wrench: Array, steps: Array) -> Array:
    """Return the samples side by side, rounded to steps (2, columns): each step's inverse and the step."""
    n, dof = q.shape
    block = np.zeros((n, steps.shape[1]))
    block[:, 0] = stamp
    block[:, 1 : 1 + dof] = q
    block[:, 1 + dof : 1 + 2 * dof] = dq
    block[:, 1 + 2 * dof : 4 + 2 * dof] = position
    block[:, 4 + 2 * dof : 8 + 2 * dof] = quat
    block[:, 8 + 2 * dof :] = wrench
    for i in range(n):
        for j in range(steps.shape[1]):
            block[i, j] = np.rint(block[i, j] * steps[0, j]) * steps[1, j]
    return block


class Rounding:
    """Rounds the observations of one robot.

    Args:
        dof: Number of joints.
    """

    def __init__(self, dof: int) -> None:
        widths = (1, dof, dof, 3, 4, 3, 3)
        steps = (STAMP_S, JOINT_RAD, JOINT_RAD_S, POSITION_M, QUATERNION, FORCE_N, TORQUE_NM)
        self._steps: Array = np.repeat(np.array([[1.0 / s for s in steps], steps]), widths, axis=1)
        a = 1 + dof
        self._dq, self._p, self._w, self._f = a, a + dof, a + dof + 3, a + dof + 7

    def __call__(self, o: Observation) -> Observation:
        """Return the observation as the record will hold it."""
        block = _rounded(o.stamp_s, o.q, o.dq, o.position_B_P, o.quat_B_P, o.wrench_S, self._steps)
        g = o.gripper
        gripper = GripperState(
            _number(g.stamp_s, STAMP_S), _number(g.aperture_m, APERTURE_M), _number(g.force_N, FORCE_N), g.moving
        )
        frame = o.tactile
        if frame is not None:
            left, right = to_step(frame.left_m, DEPTH_M), to_step(frame.right_m, DEPTH_M)
            frame = TactileFrame(_number(frame.stamp_s, STAMP_S), left, right)
        images = o.images
        if images is not None:
            images = GelImages(_number(images.stamp_s, STAMP_S), images.left, images.right)
        dq, p, w, f = self._dq, self._p, self._w, self._f
        return Observation(
            block[:, 0],
            block[:, 1:dq],
            block[:, dq:p],
            block[:, p:w],
            block[:, w:f],
            block[:, f:],
            gripper,
            frame,
            images,
        )


def _number(value: float, step: float) -> float:
    scaled = value * (1.0 / step)
    return round(scaled) * step if abs(scaled) < 2**53 else value  # NaN and infinities pass unchanged
