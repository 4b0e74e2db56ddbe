"""The wrench of what hangs below the wrist while it is accelerated: known, so it can be taken out.

A sensor at S feels, of a body of mass m whose centre of mass is at c, the d'Alembert force F = -m a and the torque
T = c x F when the body is moved without turning (the hand keeps its orientation in every guarded move). m and c come
from the robot's and the probe's data, a from the measured motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array, Gripper, Observation, ParamError, Pose, Probe, frozen_array, quat_to_matrix

NEAREST = 9
"""An acceleration is taken from so many samples: at 1 kHz, 4 ms to either side, as far as a usual wrist sensor is late.
White noise of 1 um in the positions becomes 0.11 m/s2, before the guard's filter."""
NEIGHBOURS = np.arange(NEAREST)
EVEN_S = 1e-7
"""Steps between samples that differ by less are even."""
BEFORE_S = 0.001
"""The hand is taken to have stood before the first sample, at this spacing."""


@dataclass(frozen=True)
class Carried:
    """What hangs below the wrist sensor, as one body.

    Attributes:
        mass_kg: Its mass.
        com_S_m: (3,) its centre of mass in S.
    """

    mass_kg: float
    com_S_m: Array

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass_kg) and self.mass_kg > 0):
            raise ParamError("carried.mass_kg", self.mass_kg, "finite and positive")
        object.__setattr__(self, "com_S_m", frozen_array("carried.com_S_m", self.com_S_m, (3,)))

    @classmethod
    def of(cls, parts: Sequence[tuple[float, npt.ArrayLike]]) -> Carried:
        """Several bodies, each (mass kg, centre of mass (3,) in S), as one."""
        masses = np.array([mass for mass, _ in parts])
        centres = np.array([np.asarray(com, dtype=np.float64) for _, com in parts])
        return cls(float(masses.sum()), masses @ centres / masses.sum())

    @classmethod
    def hand(cls, gripper: Gripper, probe: Probe | None = None) -> Carried:
        """Gripper body and two fingers, and the probe when its handle is between the pads."""
        middle = gripper.pose_E_P.apply((gripper.finger.centre_m[0], 0.0, gripper.finger.centre_m[2]))
        parts = [(gripper.mass_kg, np.asarray(gripper.com_E_m)), (2 * gripper.finger_mass_kg, middle)]
        if probe is not None:
            parts.append((probe.mass_kg, gripper.pose_E_P.apply((0.0, 0.0, probe.com_below_grasp_m))))
        return cls.of(parts)

    def wrench_S(self, acceleration_S_m_s2: Array) -> Array:
        """(..., 6) force N and torque Nm the sensor feels, in S at S, for accelerations (..., 3) without turning."""
        force = -self.mass_kg * np.asarray(acceleration_S_m_s2, dtype=np.float64)
        return np.concatenate([force, np.cross(self.com_S_m, force)], axis=-1)


class MeasuredInertia:
    """The inertial wrench in the newest samples, block by block, from how the hand was measured to move.

    Its acceleration at a time is that of the parabola that fits the `NEAREST` positions best (on an even grid the
    filter of Savitzky and Golay, 1964), read `lag_s` before each sample: for a sensor that reports late, no samples of
    the future are needed. What the plan says would be free of noise, but an arm does not follow it to the millisecond
    when commands come late. Samples may be missing: stamps count. The hand does not turn.

    Args:
        carried: What is moved.
        pose_E_P: P in E (S = E).
        lag_s: The sensor reports the wrench so much later than the arm reports the motion.
    """

    def __init__(self, carried: Carried, pose_E_P: Pose, lag_s: float) -> None:
        self._carried, self._R_P_E, self._lag_s = carried, pose_E_P.rotation.T, lag_s
        self._stamp_s: Array | None = None
        self._position_m: Array = np.zeros((0, 3))

    def __call__(self, o: Observation) -> Array:
        """(n, 6) expected wrench in S at S of a block's n samples; blocks in order."""
        if self._stamp_s is None:
            before = NEAREST + math.ceil(self._lag_s / BEFORE_S)
            self._stamp_s = o.stamp_s[0] - BEFORE_S * np.arange(before, 0, -1)
            self._position_m = np.repeat(o.position_B_P[:1], before, axis=0)
        stamps = np.concatenate([self._stamp_s, o.stamp_s])
        places = np.concatenate([self._position_m, o.position_B_P])
        nearest = np.searchsorted(0.5 * (stamps[1:] + stamps[:-1]), o.stamp_s - self._lag_s)
        first = np.clip(nearest - NEAREST // 2, 0, len(stamps) - NEAREST)
        kept = max(0, int(first[-1]) - NEAREST)
        self._stamp_s, self._position_m = stamps[kept:], places[kept:]
        steps: Array = np.diff(stamps[first[0] : first[-1] + NEAREST])
        near = first[:, None] + NEIGHBOURS
        if steps.max() - steps.min() < EVEN_S:
            acceleration = np.einsum("k,nkc->nc", EVENLY / steps[0] ** 2, places[near])
        else:
            acceleration = np.einsum("nk,nkc->nc", _bend(stamps[near]), places[near])
        return self._carried.wrench_S(acceleration @ (quat_to_matrix(o.quat_B_P[-1]) @ self._R_P_E))


def _bend(stamp_s: Array) -> Array:
    """(n, k) weights that give, of values at stamps (n, k), the second derivative of the best parabola.

    The parabola's leading coefficient is the values' share of x^2 made orthogonal to 1 and x.
    """
    x = stamp_s - stamp_s.mean(axis=1, keepdims=True)
    square = x * x
    second = square.sum(axis=1, keepdims=True)
    bow = square - second / x.shape[1] - x * ((square * x).sum(axis=1, keepdims=True) / second)
    return np.asarray(2.0 * bow / (bow * bow).sum(axis=1, keepdims=True))


EVENLY = _bend(NEIGHBOURS[None].astype(np.float64))[0]
