"""Hard stop: limits of the raw wrench, independent of the contact guard but for the baseline (paper III-A)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.touch.detection.baseline import Baseline
from glotouch_bt.perception.touch.detection.guard_params import GuardParams
from glotouch_bt.robot import Array, Observation


@dataclass(frozen=True)
class HardTrip:
    """Violation of a hard limit: quantity (with unit), value, limit and time."""

    quantity: str
    value: float
    limit: float
    stamp_s: float


@compiled("given f8[:, :]", "given f8[:]", "f8[::1]")
def _within(wrench: Array, median: Array, limits: Array) -> bool:
    """Return True if every sample is within the limits (4,): force and torque, and those of the residual."""
    for i in range(len(wrench)):
        force_2 = torque_2 = rest_force_2 = rest_torque_2 = 0.0
        for j in range(3):
            force_2 += wrench[i, j] ** 2
            torque_2 += wrench[i, j + 3] ** 2
            rest_force_2 += (wrench[i, j] - median[j]) ** 2
            rest_torque_2 += (wrench[i, j + 3] - median[j + 3]) ** 2
        if not (force_2 < limits[0] ** 2 and torque_2 < limits[1] ** 2):
            return False
        if not (rest_force_2 < limits[2] ** 2 and rest_torque_2 < limits[3] ** 2):
            return False
    return True


class HardStop:
    """Limit the absolute and residual wrench norms; one unfiltered sample suffices.

    Args:
        baseline: Subtracted for the residual limits.
        params: The four hard limits.
    """

    def __init__(self, baseline: Baseline, params: GuardParams) -> None:
        self._median = baseline.median
        self._limits = (
            ("force_N", params.hard_force_N),
            ("torque_Nm", params.hard_torque_Nm),
            ("residual_force_N", params.hard_residual_N),
            ("residual_torque_Nm", params.hard_residual_Nm),
        )
        self._fast_limits: Array = np.array([limit for _, limit in self._limits])

    def __call__(self, observation: Observation) -> HardTrip | None:
        """Return the earliest violation in a block, or None."""
        w = observation.wrench_S
        if _within(w, self._median, self._fast_limits):
            return None
        r = w - self._median
        norms = [np.linalg.norm(v, axis=1) for v in (w[:, :3], w[:, 3:], r[:, :3], r[:, 3:])]
        trips = []
        for (quantity, limit), norm in zip(self._limits, norms, strict=True):
            # The negated comparison also trips on NaN.
            bad = np.nonzero(~(norm <= limit))[0]
            if len(bad):
                trips.append(
                    (int(bad[0]), HardTrip(quantity, float(norm[bad[0]]), limit, float(observation.stamp_s[bad[0]])))
                )
        return min(trips, key=lambda t: t[0])[1] if trips else None
