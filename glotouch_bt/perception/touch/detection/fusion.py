"""Tip force from the wrist's force AND torque, by weighted least squares.

A point force f at the tip p gives F = f and T = p x f at the sensor. The best linear unbiased estimate is
f = (W_F + [p]' W_T [p])^-1 (W_F F + [p]' W_T T), with [p] the cross-product matrix. At a 0.34 m lever the torque
determines the two lateral directions (noise 0.009 N per sample, 0.05 N from force alone), the force the third.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, Pose, cross_matrix, frozen_array

SD_FLOOR_N = 0.005
"""Minimum force noise: an ideal sensor must not give infinite weights or a zero onset threshold."""
SD_FLOOR_NM = 0.0003
"""Minimum torque noise, for the same reason."""


@dataclass(frozen=True)
class TipFusion:
    """Linear estimate of the tip force from a wrench.

    Attributes:
        gain: (3, 6); tip force in S = gain @ (wrench_S - baseline).
        covariance: (3, 3) of one sample's estimate, N^2, in S.
    """

    gain: Array
    covariance: Array

    @classmethod
    def for_tip(cls, tip_P_m: Array, pose_E_P: Pose, sd: Array) -> TipFusion:
        """Build the estimator for a tip (3,) in P and a sensor (S = E) with noise sd (6,) N and Nm per sample."""
        lever = pose_E_P.apply(frozen_array("tip_P_m", tip_P_m, (3,)))
        w_force = 1.0 / np.maximum(sd[:3], SD_FLOOR_N) ** 2
        w_torque = 1.0 / np.maximum(sd[3:], SD_FLOOR_NM) ** 2
        arm = cross_matrix(lever)
        covariance = np.linalg.inv(np.diag(w_force) + (arm.T * w_torque) @ arm)
        gain = covariance @ np.hstack([np.diag(w_force), arm.T * w_torque])
        return cls(frozen_array("gain", gain, (3, 6)), frozen_array("covariance", covariance, (3, 3)))

    def __call__(self, residual_S: Array) -> Array:
        """Return tip forces (n, 3) in S, N, for residual wrenches (n, 6)."""
        return np.asarray(residual_S @ self.gain.T)

    def sd_along(self, direction_S: Array) -> float:
        """Return the standard deviation, N, of one unfiltered sample along a unit direction (3,)."""
        return float(np.sqrt(direction_S @ self.covariance @ direction_S))
