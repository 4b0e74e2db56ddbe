"""Model of the wrist force sensor: noise, drift, latency, tare, and the controller's imperfect load model."""

from __future__ import annotations

import math

import numpy as np

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.model import STEP_S, STEPS
from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, Conditions, RobotDescription, cross_matrix
from glotouch_bt.robot.scene import stream

GRAVITY_M_S2 = 9.81
RANGE_N, RANGE_NM = 130.0, 10.0
"""Ranges by which cross-talk is scaled. Source: data sheet of the ATI Gamma SI-130-10, an industrial wrist sensor."""
NOISE_BLOCKS = 128
"""Number of periods for which noise is drawn at once."""


def weight_matrix(mass_kg: float, com_S_m: Array) -> Array:
    """Return the matrix (6, 3) that maps `up` (B's z axis in S) to the wrench of a weight on the sensor, in S about S.

    Force -m g up; torque com x force.
    """
    return np.asarray(-mass_kg * GRAVITY_M_S2 * np.vstack([np.eye(3), cross_matrix(com_S_m)]))


def calibration_errors(conditions: Conditions, seed: int) -> tuple[Array, Array]:
    """Return the gain errors (6,) and the cross-talk (6, 6, zero diagonal) of the sensor's axes.

    Cross-talk is relative to the axes' ranges. Five independent entries of sd / sqrt(5) make a row: with equal shares
    of the other ranges applied, the reading has the given sd.
    """
    rng = stream(seed, "wrench calibration")
    gain = conditions.wrench_gain_sd * rng.standard_normal(6)
    cross = conditions.wrench_cross_talk_sd / math.sqrt(5.0) * rng.standard_normal((6, 6))
    np.fill_diagonal(cross, 0.0)
    ranges = np.array([RANGE_N] * 3 + [RANGE_NM] * 3)
    return gain, cross * ranges[:, None] / ranges[None, :]


def up_in(quat_B_S: Array) -> Array:
    """Return B's z axis (3,) in S: the third row of the rotation matrix."""
    w, x, y, z = quat_B_S.tolist()
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


@compiled("f8[:, ::1]", "i8", "i8", "f8[:, :]", "f8[:, ::1]", "f8[::1]", "f8[:, ::1]", "f8[:, ::1]")
def _read(line: Array, reach: int, start: int, new: Array, offset: Array, up: Array, noise: Array, out: Array) -> None:
    """Move `new` (n, 6) into the delay line (reach + n, 6); fill `out` (n, 6) from row `start` of the line on.

    The line's rows are reduced by `offset` (6, 4), a matrix and a constant, applied to `up` (3,). `noise` (n, 6) is
    added.
    """
    for i in range(reach):
        line[i] = line[len(new) + i]
    for i in range(len(new)):
        line[reach + i] = new[i]
    for j in range(6):
        subtracted = offset[j, 0] * up[0] + offset[j, 1] * up[1] + offset[j, 2] * up[2] + offset[j, 3]
        for i in range(len(out)):
            out[i, j] = line[start + i, j] - subtracted + noise[i, j]


@compiled("f8[:, ::1]", "f8[::1]")
def _affine(matrix: Array, at: Array) -> Array:
    """Return the wrench (6,) of a matrix (6, 4), a linear map and a constant, at a vector (3,)."""
    out = np.zeros(6)
    for i in range(6):
        out[i] = matrix[i, 0] * at[0] + matrix[i, 1] * at[1] + matrix[i, 2] * at[2] + matrix[i, 3]
    return out


class WristSensor:
    """Turn the true wrench of each step into the controller's report.

    reported(t) = C true(t - latency) + white noise + random walk - weight model - tare, with the calibration error
    C (6, 6). Before the first tare the report contains the hand's weight; after it, only the error of the controller's
    weight model, and of the calibration, remains when the hand turns.

    Args:
        description, conditions, seed: The robot, the sensor's disturbances, and their seed.
        steps: Samples in a block of `measure`; the noise of a sample does not depend on it.
        proof: Notes which axes altered a reading; default: one of its own.
    """

    def __init__(
        self,
        description: RobotDescription,
        conditions: Conditions,
        seed: int,
        steps: int = STEPS,
        proof: AxisProof | None = None,
    ) -> None:
        self._steps, self._proof = steps, proof or AxisProof(conditions)
        self._rng = stream(seed, "wrench")
        draw = stream(seed, "payload")
        self._mass_factor = 1.0 + conditions.payload_mass_error * float(draw.standard_normal())
        self._com_error = conditions.payload_com_error_m * draw.standard_normal(3)
        mass, com = description.gripper.mass_and_com_E()
        self._hand = weight_matrix(mass * self._mass_factor, com + self._com_error)
        self._P_in_S = description.gripper.pose_E_P
        self._payload = np.zeros((6, 3))
        self._bias = np.zeros(6)
        self._up_at_tare: Array | None = None
        self._late = round(conditions.wrench_latency_s / STEP_S)
        self._jitter = round(conditions.latency_jitter_s / STEP_S)
        self._jitter_rng = stream(seed, "wrench jitter")
        self._reach = self._late + self._jitter
        self._line = np.zeros((self._reach + steps, 6))
        self._gain_error, self._cross_talk = calibration_errors(conditions, seed)
        self._calibrated = not (self._gain_error.any() or self._cross_talk.any())
        self._sd = np.array([conditions.force_noise_sd_N] * 3 + [conditions.torque_noise_sd_Nm] * 3)
        self._walk_sd = conditions.force_drift_N_per_sqrt_min * float(np.sqrt(STEP_S / 60.0))
        self._walk = np.zeros(3)
        self._torque_rng = stream(seed, "torque drift")
        self._torque_walk_sd = conditions.torque_drift_Nm_per_sqrt_min * float(np.sqrt(STEP_S / 60.0))
        self._torque_walk = np.zeros(3)
        self._noisy = bool(self._sd.any() or self._walk_sd > 0 or self._torque_walk_sd > 0)
        self._noise = np.zeros((NOISE_BLOCKS, steps, 6))
        self._block = NOISE_BLOCKS
        self._measured = np.zeros((steps, 6))
        self._renew()

    def _renew(self) -> None:
        """Combine payload, tare and hand into affine maps (6, 4) of `up`: the subtracted and the expected wrench."""
        if self._up_at_tare is None:
            self._offset = np.column_stack([self._payload, np.zeros(6)])
            self._expected = np.column_stack([self._payload + self._hand, np.zeros(6)])
        else:
            constant = -self._hand @ self._up_at_tare
            self._offset = np.column_stack([self._payload + self._hand, constant])
            self._expected = np.column_stack([self._payload + self._hand, constant + self._bias])

    def set_payload(self, mass_kg: float, com_P_m: Array) -> None:
        """Set the payload that the controller subtracts, with the errors of the conditions."""
        self._payload = weight_matrix(mass_kg * self._mass_factor, self._P_in_S.apply(com_P_m) + self._com_error)
        self._renew()

    def tare(self, mean: Array, up: Array) -> None:
        """Subtract `mean` (6,), an average of `measure`, from now on; `up` is `up_in` at the tare."""
        change = np.zeros(6) if self._up_at_tare is None else self._hand @ (up - self._up_at_tare)
        self._bias = mean + change  # `measure` has removed the change since the last tare
        self._up_at_tare = up
        self._renew()

    def expected(self, up: Array) -> Array:
        """Return the reading (6,) without contact at the orientation `up`; the hard limit is measured from it."""
        return _affine(self._expected, up)

    def fill(self, wrench: Array) -> None:
        """Fill the delay line with a true `wrench` (6,)."""
        self._line[:] = self._misread(wrench[None])

    def measure(self, true: Array, up: Array) -> Array:
        """Return the measured block (n, 6) for a true one, before the tare's bias is subtracted: the input of a tare.

        `up` (3,) is `up_in` of the sensor's orientation. The next call overwrites the array.
        """
        steps, line, start = self._steps, self._line, self._jitter
        new = true if self._calibrated else self._misread(true)
        if start:
            start -= max(int(self._jitter_rng.integers(-start, start + 1)), -self._late)
        if self._noisy and self._block == NOISE_BLOCKS:
            self._draw()
        _read(line, self._reach, start, new, self._offset, up, self._noise[self._block % NOISE_BLOCKS], self._measured)
        if self._jitter:
            self._proof.saw("latency_jitter_s", line[self._jitter : self._jitter + steps], line[start : start + steps])
        if self._noisy:
            self._block += 1
        return self._measured

    def _misread(self, true: Array) -> Array:
        """Return the readings (n, 6) of true wrenches."""
        gained = true + true * self._gain_error
        self._proof.saw("wrench_gain_sd", true, gained)
        crossed = np.asarray(gained + true @ self._cross_talk.T)
        self._proof.saw("wrench_cross_talk_sd", gained, crossed)
        return crossed

    @property
    def bias(self) -> Array:
        """Bias (6,) of the last tare."""
        return self._bias

    def _draw(self) -> None:
        n = NOISE_BLOCKS * self._steps
        noise = self._rng.standard_normal((n, 9))
        walk = self._walk + np.cumsum(self._walk_sd * noise[:, 6:], axis=0)
        self._walk = walk[-1]
        noise[:, :6] *= self._sd
        noise[:, :3] += walk
        if self._torque_walk_sd > 0.0:
            steps = self._torque_walk_sd * self._torque_rng.standard_normal((n, 3))
            torque_walk = self._torque_walk + np.cumsum(steps, axis=0)
            self._proof.saw("torque_drift_Nm_per_sqrt_min", self._torque_walk, torque_walk[-1])
            self._torque_walk = torque_walk[-1]
            noise[:, 3:6] += torque_walk
        self._noise[:] = noise[:, :6].reshape(NOISE_BLOCKS, self._steps, 6)
        self._block = 0
