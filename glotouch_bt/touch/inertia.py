"""The wrench of what hangs below the wrist while it is accelerated: known before it is felt, so it can be taken out.

A sensor at S feels, of a body of mass m whose centre of mass is at c, the d'Alembert force F = -m a and the torque
T = c x F when the body is moved without turning (the hand keeps its orientation in every guarded move). m and c come
from the robot's and the probe's data, a from the motion plan.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array, Gripper, ParamError, Probe
from glotouch_bt.robot.geometry import frozen_array

TRACKING_S = 0.001
"""The arm's acceleration follows the commanded one by this much (one servo step; 0-2 ms fit alike in simulation)."""


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


class CommandedInertia:
    """The inertial wrench of a straight move, block by block, from the plan's acceleration along it.

    Between two control periods the plan's acceleration is taken to run straight, and the sensor reports it late.

    Args:
        carried: What is moved.
        direction_S: (3,) unit direction of the move in S.
        along_m_s2: Gives the commanded acceleration along the move at the end of the newest control period.
        latency_s: Age of a wrench sample when it arrives.
        rate_Hz: Sampling rate.
    """

    def __init__(
        self,
        carried: Carried,
        direction_S: Array,
        along_m_s2: Callable[[], float],
        latency_s: float,
        rate_Hz: float = 1000.0,
    ) -> None:
        self._unit = carried.wrench_S(direction_S)
        self._along = along_m_s2
        self._late = round((latency_s + TRACKING_S) * rate_Hz)
        self._line: Array = np.zeros(self._late)
        self._last = 0.0
        self._ramps: dict[int, Array] = {}

    def __call__(self, n: int) -> Array:
        """(n, 6) expected wrench of the next n samples, one control period's block."""
        now, last = self._along(), self._last
        if now == 0.0 == last and not np.count_nonzero(self._line):
            return np.zeros((n, 6))
        ramp = self._ramps.get(n)
        if ramp is None:
            ramp = self._ramps[n] = np.arange(1, n + 1) / n
        line = np.concatenate([self._line, last + (now - last) * ramp])
        self._line, self._last = line[n:], now
        return line[:n, None] * self._unit
