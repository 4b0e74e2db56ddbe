"""Hard stop: limits of the raw wrench, independent of the contact guard but for the baseline (paper III-A)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.detection.baseline import Baseline
from glotouch_bt.perception.touch.detection.guard_params import GuardParams
from glotouch_bt.robot import Observation


@dataclass(frozen=True)
class HardTrip:
    """Violation of a hard limit: quantity (with unit), value, limit and time."""

    quantity: str
    value: float
    limit: float
    stamp_s: float


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
        force, torque, residual_force, residual_torque = (1.0 / limit for _, limit in self._limits)
        self._scale = np.array([force] * 3 + [torque] * 3)
        self._residual_scale = np.array([residual_force] * 3 + [residual_torque] * 3)

    def __call__(self, observation: Observation) -> HardTrip | None:
        """Return the earliest violation in a block, or None."""
        w = observation.wrench_S
        r = w - self._median
        whole, rest = (w * self._scale).ravel(), (r * self._residual_scale).ravel()
        if whole @ whole < 1.0 and rest @ rest < 1.0:  # early exit: no violation and no NaN is possible
            return None
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
