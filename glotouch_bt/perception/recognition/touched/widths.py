"""Widths between and beyond those that were felt: Gaussian process regression over yaw, shift and height.

The mean is the extent of the traced outline. The residual is the sum of a part that depends on height only, as of a
body of revolution, and of a part of each place (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2.2).
A width is the same from both sides: yaw + 180 deg with the shift reversed. The kernel is summed over both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.robot import Array


@dataclass(frozen=True, kw_only=True)
class WidthKernel:
    """Kernel of the residual of a width about the outline's extent, and its noise.

    Attributes:
        common_m, place_m: Standard deviation of the part common to a height, and of that of each place.
        common_z_m: Length scale of the common part in height.
        phi_rad, l_m, z_m: Length scales of the part of a place.
        noise_m: Standard deviation of a felt width, with that of the place where it was felt.
    """

    common_m: float = 6e-3
    place_m: float = 5e-3
    common_z_m: float = 0.020
    phi_rad: float = math.radians(40.0)
    l_m: float = 0.020
    z_m: float = 0.020
    noise_m: float = 0.5e-3

    def __call__(self, a: Array, b: Array) -> Array:
        """Return the covariance (len(a), len(b)), m^2, of places (.., 3): yaw, shift, height."""
        mirrored = b * [1.0, -1.0, 1.0] + [math.pi, 0.0, 0.0]
        common = self.common_m**2 * _matern(np.abs(a[:, None, 2] - b[None, :, 2]) / self.common_z_m)
        return np.asarray(common + self.place_m**2 * (self._place(a, b) + self._place(a, mirrored)))

    def _place(self, a: Array, b: Array) -> Array:
        phi, l, z = (a[:, None, i] - b[None, :, i] for i in range(3))
        chord = 2 * np.sin(0.5 * phi) / self.phi_rad
        return _matern(np.sqrt(chord**2 + (l / self.l_m) ** 2 + (z / self.z_m) ** 2))


def _matern(r: Array) -> Array:
    """Return the Matern kernel of order 3/2 at scaled distances."""
    q = math.sqrt(3.0) * r
    return np.asarray((1 + q) * np.exp(-q))


def interpolated(at: Array, residual_m: Array, wanted: Array, kernel: WidthKernel) -> tuple[Array, Array]:
    """Return mean and standard deviation (k,), m, of the residuals at places (k, 3), given those (n,) at (n, 3)."""
    covariance = kernel(at, at) + kernel.noise_m**2 * np.eye(len(at))
    factor = scipy.linalg.cho_factor(covariance, lower=True)
    weights = scipy.linalg.cho_solve(factor, residual_m)
    prior = float(kernel(wanted[:1], wanted[:1])[0, 0])
    mean, variance = [], []
    for some in np.array_split(wanted, max(1, len(wanted) // 8192)):
        cross = kernel(some, at)
        mean.append(cross @ weights)
        half = scipy.linalg.solve_triangular(factor[0], cross.T, lower=True)
        variance.append(prior - np.square(half).sum(axis=0))
    return np.concatenate(mean), np.sqrt(np.maximum(np.concatenate(variance), 0.0))
