"""The wrench of what hangs below the wrist while it is accelerated: known before it is felt, so it can be taken out.

A sensor at S feels, of a body of mass m whose centre of mass is at c, the d'Alembert force F = -m a and the torque
T = c x F when the body is moved without turning (the hand keeps its orientation in every guarded move). m and c come
from the robot's and the probe's data, a from the motion plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array, Gripper, ParamError, Probe
from glotouch_bt.robot.geometry import frozen_array

TRACKING_S = 0.001
"""The arm's acceleration follows the commanded one by this much where nobody has measured it (one servo step)."""


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

    Within a control period the plan's acceleration is taken to run straight, to reach its value with the newest sample;
    before it, however long that was, it stays. The sensor reports it late. Samples may be missing: stamps count.

    Args:
        carried: What is moved.
        direction_S: (3,) unit direction of the move in S.
        along_m_s2: Gives the commanded acceleration along the move at the end of the newest control period.
        lag_s: The sensor reports it so much later than it was commanded.
        period_s: Control period.
    """

    def __init__(
        self,
        carried: Carried,
        direction_S: Array,
        along_m_s2: Callable[[], float],
        lag_s: float,
        period_s: float = 0.01,
    ) -> None:
        self._unit = carried.wrench_S(direction_S)
        self._along, self._lag_s, self._period_s = along_m_s2, lag_s, period_s
        self._stamps_s: list[float] = []
        self._values_m_s2: list[float] = []
        self._last = 0.0
        self._quiet_s = -math.inf

    def __call__(self, stamp_s: Array) -> Array:
        """(n, 6) expected wrench of the newest samples, those of `stamp_s` (n,), the robot's clock."""
        now, last, end = self._along(), self._last, float(stamp_s[-1])
        if now == 0.0 == last:
            if float(stamp_s[0]) - self._lag_s > self._quiet_s:
                return np.zeros((len(stamp_s), 6))
        else:
            self._quiet_s = end
        stamps, values = self._stamps_s, self._values_m_s2
        stamps += [max(end - self._period_s, stamps[-1]) if stamps else end - self._period_s, end]
        values += [last, now]
        self._last = now
        line = np.interp(stamp_s - self._lag_s, stamps, values)
        while len(stamps) > 2 and stamps[2] < end - self._lag_s:
            del stamps[:2], values[:2]
        return np.asarray(line[:, None] * self._unit)
