"""The hard rule beside the contact guard: limits of the raw wrench that no touch may pass (paper III-A).

Independent of the soft rule in all but the baseline: no filter, no direction, no inertia model, one sample is enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.touch.detection.baseline import Baseline
from glotouch_bt.perception.touch.detection.guard_params import GuardParams
from glotouch_bt.robot import Observation


@dataclass(frozen=True)
class HardTrip:
    """A hard limit passed: which quantity (unit in its name), its value, its limit, and when."""

    quantity: str
    value: float
    limit: float
    stamp_s: float


class HardStop:
    """The envelope beside the soft rule: absolute and residual wrench norms, unfiltered, one sample is enough.

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
        """The earliest sample of the block beyond a limit, or None."""
        w = observation.wrench_S
        r = w - self._median
        whole, rest = (w * self._scale).ravel(), (r * self._residual_scale).ravel()
        if whole @ whole < 1.0 and rest @ rest < 1.0:  # not one sample can be beyond a limit, nor a NaN among them
            return None
        norms = [np.linalg.norm(v, axis=1) for v in (w[:, :3], w[:, 3:], r[:, :3], r[:, 3:])]
        trips = []
        for (quantity, limit), norm in zip(self._limits, norms, strict=True):
            # NOT below the limit: a NaN from the sensor trips as well
            bad = np.nonzero(~(norm <= limit))[0]
            if len(bad):
                trips.append(
                    (int(bad[0]), HardTrip(quantity, float(norm[bad[0]]), limit, float(observation.stamp_s[bad[0]])))
                )
        return min(trips, key=lambda t: t[0])[1] if trips else None
