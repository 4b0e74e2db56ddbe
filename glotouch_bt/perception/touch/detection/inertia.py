"""Inertial wrench of the payload below the wrist sensor.

For a translation with acceleration a, a sensor at S measures F = -m a and T = c x F for mass m and centre of mass c.
The hand keeps its orientation in guarded moves. m and c come from robot and probe data, a from the measured motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, Gripper, Observation, ParamError, Pose, Probe, frozen_array, quat_to_matrix

NEAREST = 9
"""Number of samples per acceleration: 4 ms to either side at 1 kHz, a usual wrist latency. Position noise of 1 um gives
0.11 m/s2 before the guard's filter."""
BEFORE_S = 0.001
"""Spacing of the padding before the first sample; the hand is assumed at rest there."""


@dataclass(frozen=True)
class Payload:
    """Payload of the wrist sensor as one body.

    Attributes:
        mass_kg: Mass.
        com_S_m: (3,) centre of mass in S.
    """

    mass_kg: float
    com_S_m: Array

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass_kg) and self.mass_kg > 0):
            raise ParamError("carried.mass_kg", self.mass_kg, "finite and positive")
        object.__setattr__(self, "com_S_m", frozen_array("carried.com_S_m", self.com_S_m, (3,)))

    @classmethod
    def of(cls, parts: Sequence[tuple[float, npt.ArrayLike]]) -> Payload:
        """Combine bodies, each (mass kg, centre of mass (3,) in S)."""
        masses = np.array([mass for mass, _ in parts])
        centres = np.array([np.asarray(com, dtype=np.float64) for _, com in parts])
        return cls(float(masses.sum()), masses @ centres / masses.sum())

    @classmethod
    def hand(cls, gripper: Gripper, probe: Probe | None = None) -> Payload:
        """Return the payload of gripper body and fingers, and of the probe if held."""
        middle = gripper.pose_E_P.apply((gripper.finger.centre_m[0], 0.0, gripper.finger.centre_m[2]))
        parts = [(gripper.mass_kg, np.asarray(gripper.com_E_m)), (2 * gripper.finger_mass_kg, middle)]
        if probe is not None:
            parts.append((probe.mass_kg, gripper.pose_E_P.apply((0.0, 0.0, probe.com_below_grasp_m))))
        return cls.of(parts)

    def wrench_S(self, acceleration_S_m_s2: Array) -> Array:
        """Return the inertial wrench (..., 6) N and Nm in S at S for accelerations (..., 3) of a translation."""
        a = np.asarray(acceleration_S_m_s2, dtype=np.float64)
        return _inertial(a.reshape(-1, 3), self.mass_kg, self.com_S_m).reshape(*a.shape[:-1], 6)


@compiled("given f8[:, :]", "f8", "given f8[:]")
def _inertial(acceleration: Array, mass_kg: float, com: Array) -> Array:
    """Return force and torque (n, 6) of accelerations (n, 3); `com` (3,)."""
    out = np.zeros((len(acceleration), 6))
    for i in range(len(out)):
        x, y, z = -mass_kg * acceleration[i, 0], -mass_kg * acceleration[i, 1], -mass_kg * acceleration[i, 2]
        out[i, 0], out[i, 1], out[i, 2] = x, y, z
        out[i, 3], out[i, 4], out[i, 5] = com[1] * z - com[2] * y, com[2] * x - com[0] * z, com[0] * y - com[1] * x
    return out


@compiled("f8[::1]", "f8[:, ::1]", "given f8[:]", "given f8[:, :]", "f8")
def _bends(last_s: Array, last_m: Array, new_s: Array, new_m: Array, lag_s: float) -> tuple[Array, Array, Array]:
    """Return the stamps and places to keep for the next block, and the accelerations (n, 3) in this one.

    They are those `lag_s` before the new samples: the second derivative of the least-squares parabola through a window.
    It is the sum of the values, weighted with x^2 made orthogonal to 1 and x, over the norm of these weights; x are
    the stamps from their mean.

    Args:
        last_s, last_m: (m,), (m, 3) stamps and places kept of the blocks before.
        new_s, new_m: (n,), (n, 3) of this block.
        lag_s: See `MeasuredInertia`.
    """
    m, n, nearest, first = len(last_s), len(new_s), 0, 0
    stamps, places, out = np.zeros(m + n), np.zeros((m + n, 3)), np.zeros((n, 3))
    stamps[:m], stamps[m:] = last_s, new_s
    places[:m], places[m:] = last_m, new_m
    x, bow = np.zeros(NEAREST), np.zeros(NEAREST)
    for i in range(n):
        at = stamps[m + i] - lag_s
        while nearest < m + n - 1 and 0.5 * (stamps[nearest] + stamps[nearest + 1]) < at:
            nearest += 1
        first = min(max(nearest - NEAREST // 2, 0), m + n - NEAREST)
        mean = 0.0
        for k in range(NEAREST):
            mean += stamps[first + k] / NEAREST
        second = third = norm = 0.0
        for k in range(NEAREST):
            x[k] = stamps[first + k] - mean
            second += x[k] ** 2
            third += x[k] ** 3
        for k in range(NEAREST):
            bow[k] = x[k] ** 2 - second / NEAREST - x[k] * (third / second)
            norm += bow[k] ** 2
        for axis in range(3):
            total = 0.0
            for k in range(NEAREST):
                total += 2.0 * bow[k] / norm * (places[first + k, axis] - places[first, axis])
            out[i, axis] = total
    kept = max(0, first - NEAREST)
    return stamps[kept:], places[kept:], out


class MeasuredInertia:
    """Inertial wrench from the measured motion of the hand, block by block.

    The acceleration is that of the least-squares parabola through the `NEAREST` positions (Savitzky and Golay, 1964),
    `lag_s` before each sample, so no future samples are needed. The planned acceleration would have no
    noise, but an arm follows it only to some milliseconds. Missing samples are allowed. The hand does not rotate.

    Args:
        carried: The payload.
        pose_E_P: P in E (S = E).
        lag_s: Delay of the wrench behind the reported motion.
    """

    def __init__(self, carried: Payload, pose_E_P: Pose, lag_s: float) -> None:
        self._carried, self._R_P_E, self._lag_s = carried, pose_E_P.rotation.T, lag_s
        self._stamp_s: Array | None = None
        self._position_m: Array = np.zeros((0, 3))

    def __call__(self, o: Observation) -> Array:
        """Return the expected wrench (n, 6) in S at S of a block's n samples; call with blocks in order."""
        if self._stamp_s is None:
            before = NEAREST + math.ceil(self._lag_s / BEFORE_S)
            self._stamp_s = o.stamp_s[0] - BEFORE_S * np.arange(before, 0, -1)
            self._position_m = np.repeat(o.position_B_P[:1], before, axis=0)
        self._stamp_s, self._position_m, acceleration = _bends(
            self._stamp_s, self._position_m, o.stamp_s, o.position_B_P, self._lag_s
        )
        acceleration_S = acceleration @ (quat_to_matrix(o.quat_B_P[-1]) @ self._R_P_E)
        return _inertial(acceleration_S, self._carried.mass_kg, self._carried.com_S_m)
