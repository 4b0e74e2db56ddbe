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
NEIGHBOURS = np.arange(NEAREST)
"""Sample offsets of the window."""
EVEN_S = 1e-7
"""Maximum difference between sampling steps that count as equal."""
MAX_OFF_GRID = 0.45
"""Largest distance of a delayed sample from the nearest one, in sampling steps, for which no rounding decides."""
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


@compiled("f8[::1]", "f8[:, ::1]", "i8", "f8", "given f8[:]", "f8[:, ::1]")
def _even_bends(stamps: Array, places: Array, n: int, lag_s: float, evenly: Array, out: Array) -> int:
    """Fill `out` (n, 3) with the accelerations `lag_s` before the last n samples; return the last window's start.

    Return -1 if the samples are not on a uniform grid, or their windows not inside it, or the delayed samples lie
    half-way between two others, where rounding chooses one.
    """
    least = greatest = stamps[1] - stamps[0]
    for i in range(1, len(stamps) - 1):
        step = stamps[i + 1] - stamps[i]
        least, greatest = min(least, step), max(greatest, step)
    if not greatest - least < EVEN_S:
        return -1
    where = (stamps[len(stamps) - n] - lag_s - stamps[0]) / (stamps[1] - stamps[0])
    nearest = int(np.rint(where))
    at = nearest - NEAREST // 2
    if abs(where - nearest) > MAX_OFF_GRID or not 0 <= at <= len(stamps) - n - NEAREST + 1:
        return -1
    step_2 = (stamps[at + 1] - stamps[at]) ** 2
    for i in range(n):
        for axis in range(3):
            total = 0.0
            for k in range(NEAREST):
                total += evenly[k] / step_2 * places[at + i + k, axis]
            out[i, axis] = total
    return at + n - 1


class MeasuredInertia:
    """Inertial wrench from the measured motion of the hand, block by block.

    The acceleration is that of the least-squares parabola through the `NEAREST` positions (Savitzky and Golay, 1964, on
    a uniform grid), `lag_s` before each sample, so no future samples are needed. The planned acceleration would have no
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
        stamps = np.concatenate([self._stamp_s, o.stamp_s])
        places = np.concatenate([self._position_m, o.position_B_P])
        n = len(o.stamp_s)
        acceleration: Array = np.zeros((n, 3))
        last = _even_bends(stamps, places, n, self._lag_s, EVENLY, acceleration)
        if last < 0:
            nearest = np.searchsorted(0.5 * (stamps[1:] + stamps[:-1]), o.stamp_s - self._lag_s)
            first = np.clip(nearest - NEAREST // 2, 0, len(stamps) - NEAREST)
            last = int(first[-1])
            steps = np.diff(stamps[first[0] : last + NEAREST])
            near = first[:, None] + NEIGHBOURS
            if steps.max() - steps.min() < EVEN_S:
                acceleration = np.einsum("k,nkc->nc", EVENLY / steps[0] ** 2, places[near])
            else:
                acceleration = np.einsum("nk,nkc->nc", _bend(stamps[near]), places[near])
        kept = max(0, last - NEAREST)
        self._stamp_s, self._position_m = stamps[kept:], places[kept:]
        return self._carried.wrench_S(acceleration @ (quat_to_matrix(o.quat_B_P[-1]) @ self._R_P_E))


def _bend(stamp_s: Array) -> Array:
    """Return weights (n, k) that map values at stamps (n, k) to the second derivative of the least-squares parabola.

    They are x^2 made orthogonal to 1 and x, normalised.
    """
    x = stamp_s - stamp_s.mean(axis=1, keepdims=True)
    square = x * x
    second = square.sum(axis=1, keepdims=True)
    bow = square - second / x.shape[1] - x * ((square * x).sum(axis=1, keepdims=True) / second)
    return np.asarray(2.0 * bow / (bow * bow).sum(axis=1, keepdims=True))


EVENLY = _bend(NEIGHBOURS[None].astype(np.float64))[0]
"""Weights (NEAREST,) on a uniform grid of unit spacing."""
