"""The wrist force sensor: noise, drift, latency, tare, and the controller's imperfect idea of what it carries."""

from __future__ import annotations

import numpy as np

from backends.mujoco.model import STEP_S, STEPS
from backends.mujoco.streams import stream
from glotouch_bt.robot import Array, Conditions, RobotDescription
from glotouch_bt.robot.geometry import quat_to_matrix

GRAVITY_M_S2 = 9.81
BLOCKS = 128  # noise is drawn for this many periods at a time


def weight_wrench(mass_kg: float, com_S_m: Array, rotation_B_S: Array) -> Array:
    """(6,) force N and torque Nm in S, at S, of a weight hanging on the sensor."""
    force = -mass_kg * GRAVITY_M_S2 * rotation_B_S[2]
    return np.concatenate([force, np.cross(com_S_m, force)])


def hand_mass(description: RobotDescription) -> tuple[float, Array]:
    """Mass kg and centre of mass (3,) in S of all that is bolted beyond the sensor."""
    g = description.gripper
    (x, _, z), fingers = g.finger.centre_m, 2 * g.finger_mass_kg
    centre = g.pose_E_P.apply((x, 0.0, z))
    mass = g.mass_kg + fingers
    return mass, (g.mass_kg * np.asarray(g.com_E_m) + fingers * centre) / mass


class WristSensor:
    """Turns the true wrench of each step into what the controller reports.

    reported(t) = true(t - latency) + white noise + random walk - weight model - tare. Before the first tare the report
    contains the hand's weight; from then on only its change with orientation, as the controller believes it.
    """

    def __init__(self, description: RobotDescription, conditions: Conditions, seed: int) -> None:
        self._c = conditions
        self._rng = stream(seed, "wrench")
        draw = stream(seed, "payload")
        self._mass_factor = 1.0 + conditions.payload_mass_error * float(draw.standard_normal())
        self._com_error = conditions.payload_com_error_m * draw.standard_normal(3)
        mass, com = hand_mass(description)
        self._hand = (mass * self._mass_factor, com + self._com_error)
        self._P_in_S = description.gripper.pose_E_P
        self._payload: tuple[float, Array] | None = None
        self._bias = np.zeros(6)
        self._rotation_at_tare: Array | None = None
        self._late = round(conditions.wrench_latency_s / STEP_S)
        self._line = np.zeros((self._late + STEPS, 6))
        self._sd = np.array([conditions.force_noise_sd_N] * 3 + [conditions.torque_noise_sd_Nm] * 3)
        self._walk_sd = conditions.force_drift_N_per_sqrt_min * np.sqrt(STEP_S / 60.0)
        self._walk = np.zeros(3)
        self._noisy = bool(self._sd.any() or self._walk_sd > 0)
        self._noise = np.zeros((BLOCKS, STEPS, 6))
        self._block = BLOCKS
        self.untared = np.zeros((STEPS, 6))  # last block before bias, for the tare

    def set_payload(self, mass_kg: float, com_P_m: Array) -> None:
        """What the controller believes the hand carries, wrong by the condition's errors."""
        self._payload = (mass_kg * self._mass_factor, self._P_in_S.apply(com_P_m) + self._com_error)

    def tare(self, mean: Array, quat_B_S: Array) -> None:
        """Subtract `mean` (6,), an average of `untared`, taken at this orientation, from now on."""
        rotation = quat_to_matrix(quat_B_S)
        # `mean` still holds the hand's change since the last tare; the new reference orientation is here.
        self._bias = mean + self._hand_change(rotation)
        self._rotation_at_tare = rotation

    def _hand_change(self, rotation: Array) -> Array:
        if self._rotation_at_tare is None:
            return np.zeros(6)
        return weight_wrench(*self._hand, rotation) - weight_wrench(*self._hand, self._rotation_at_tare)

    def compensation(self, quat_B_S: Array) -> Array:
        """(6,) what is subtracted at this orientation, besides the tare's bias."""
        rotation = quat_to_matrix(quat_B_S)
        total = self._hand_change(rotation)
        if self._payload is not None:
            total = total + weight_wrench(*self._payload, rotation)
        return total

    def expected(self, quat_B_S: Array) -> Array:
        """(6,) what the sensor should read without contact: the basis of the hard limit."""
        offset = self.compensation(quat_B_S) + self._bias
        if self._rotation_at_tare is None:
            offset = offset + weight_wrench(*self._hand, quat_to_matrix(quat_B_S))
        return offset

    def fill(self, wrench: Array) -> None:
        """Start the delay line as if the sensor had read `wrench` (6,) for ever."""
        self._line[:] = wrench

    def report(self, true: Array, quat_B_S: Array) -> Array:
        """(n, 6) reported block for a true block (n, 6)."""
        late = self._late
        if late:
            self._line[:late] = self._line[STEPS : STEPS + late]
        self._line[late:] = true
        out = self.untared
        np.subtract(self._line[:STEPS], self.compensation(quat_B_S), out=out)
        if self._noisy:
            if self._block == BLOCKS:
                self._draw()
            out += self._noise[self._block]
            self._block += 1
        return out - self._bias

    def _draw(self) -> None:
        n = BLOCKS * STEPS
        noise = self._rng.standard_normal((n, 9))
        walk = self._walk + np.cumsum(self._walk_sd * noise[:, 6:], axis=0)
        self._walk = walk[-1]
        noise[:, :6] *= self._sd
        noise[:, :3] += walk
        self._noise[:] = noise[:, :6].reshape(BLOCKS, STEPS, 6)
        self._block = 0
