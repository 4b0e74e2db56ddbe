"""Model of the wrist force sensor: noise, drift, latency, tare, and the controller's imperfect load model."""

from __future__ import annotations

import numpy as np

from glotouch_backends.mujoco.model import STEP_S, STEPS
from glotouch_bt.robot import Array, Conditions, RobotDescription, cross_matrix
from glotouch_bt.robot.scene import stream

GRAVITY_M_S2 = 9.81
NOISE_BLOCKS = 128
"""Number of periods for which noise is drawn at once."""


def weight_matrix(mass_kg: float, com_S_m: Array) -> Array:
    """Return the matrix (6, 3) that maps `up` (B's z axis in S) to the wrench of a weight on the sensor, in S about S.

    Force -m g up; torque com x force.
    """
    return np.asarray(-mass_kg * GRAVITY_M_S2 * np.vstack([np.eye(3), cross_matrix(com_S_m)]))


def up_in(quat_B_S: Array) -> Array:
    """Return B's z axis (3,) in S: the third row of the rotation matrix."""
    w, x, y, z = quat_B_S.tolist()
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


class WristSensor:
    """Turn the true wrench of each step into the controller's report.

    reported(t) = true(t - latency) + white noise + random walk - weight model - tare. Before the first tare the report
    contains the hand's weight; after it, only the error of the controller's weight model remains when the hand turns.

    Args:
        description, conditions, seed: The robot, the sensor's disturbances, and their seed.
        steps: Samples in a block of `measure`; the noise of a sample does not depend on it.
    """

    def __init__(self, description: RobotDescription, conditions: Conditions, seed: int, steps: int = STEPS) -> None:
        self._steps = steps
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
        self._line = np.zeros((self._late + steps, 6))
        self._sd = np.array([conditions.force_noise_sd_N] * 3 + [conditions.torque_noise_sd_Nm] * 3)
        self._walk_sd = conditions.force_drift_N_per_sqrt_min * float(np.sqrt(STEP_S / 60.0))
        self._walk = np.zeros(3)
        self._noisy = bool(self._sd.any() or self._walk_sd > 0)
        self._noise = np.zeros((NOISE_BLOCKS, steps, 6))
        self._block = NOISE_BLOCKS
        self._measured = np.zeros((steps, 6))
        self._renew()

    def _renew(self) -> None:
        """Combine payload, tare and hand into two affine maps of `up`: the subtracted and the expected wrench."""
        if self._up_at_tare is None:
            self._offset = (self._payload, np.zeros(6))
            self._expected = (self._payload + self._hand, np.zeros(6))
        else:
            self._offset = (self._payload + self._hand, -self._hand @ self._up_at_tare)
            self._expected = (self._offset[0], self._offset[1] + self._bias)

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
        matrix, constant = self._expected
        return np.asarray(matrix @ up + constant)

    def fill(self, wrench: Array) -> None:
        """Fill the delay line with `wrench` (6,)."""
        self._line[:] = wrench

    def measure(self, true: Array, up: Array) -> Array:
        """Return the measured block (n, 6) for a true one, before the tare's bias is subtracted: the input of a tare.

        `up` (3,) is `up_in` of the sensor's orientation. The next call overwrites the array.
        """
        late = self._late
        if late:
            self._line[:late] = self._line[self._steps : self._steps + late]
        self._line[late:] = true
        matrix, constant = self._offset
        out = self._measured
        np.subtract(self._line[: self._steps], matrix @ up + constant, out=out)
        if self._noisy:
            if self._block == NOISE_BLOCKS:
                self._draw()
            out += self._noise[self._block]
            self._block += 1
        return out

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
        self._noise[:] = noise[:, :6].reshape(NOISE_BLOCKS, self._steps, 6)
        self._block = 0
