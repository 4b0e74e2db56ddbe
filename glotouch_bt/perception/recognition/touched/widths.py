"""Widths between and beyond those that were felt: Gaussian process regression over yaw, shift and height.

The mean is the extent of the traced outline. The residual is the sum of a part that depends on height only, as of a
body of revolution, and of a part of each place (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2.2).
Some objects are smooth, others have steps. So the amplitude of the residual is unknown: predictions for several
amplitudes are weighted with the marginal likelihood of the felt widths (ibid., 5.2).
A width is the same from both sides: yaw + 180 deg with the shift reversed. The kernel is summed over both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.robot import Array

AMPLITUDES = (0.15, 0.3, 0.6, 1.0, 1.5)
"""Amplitudes of the residual relative to the kernel's, equally likely before anything is felt. Source: ours; over 25
objects, the tables' residuals have an RMS of 0 to 16 mm."""


ELSEWHERE = 0.2
"""Probability that the object is of another kind where it was not felt, so that any amplitude is possible. Source:
ours; a can may have a handle."""


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
    covariance, noise = kernel(at, at), kernel.noise_m**2 * np.eye(len(at))
    factors = [np.linalg.cholesky(a * a * covariance + noise) for a in AMPLITUDES]
    white = [scipy.linalg.solve_triangular(f, residual_m, lower=True) for f in factors]
    log_share = np.array([-0.5 * w @ w - np.log(np.diag(f)).sum() for w, f in zip(white, factors, strict=True)])
    share = np.exp(log_share - log_share.max())
    share = (1 - ELSEWHERE) * share / share.sum() + ELSEWHERE / len(share)
    prior = float(kernel(wanted[:1], wanted[:1])[0, 0])
    means, sds = [], []
    for some in np.array_split(wanted, max(1, len(wanted) // 8192)):
        cross = kernel(at, some)
        mean, square = np.zeros(len(some)), np.zeros(len(some))
        for a, p, f, w in zip(AMPLITUDES, share, factors, white, strict=True):
            if p > 1e-4:
                half = scipy.linalg.solve_triangular(f, a * a * cross, lower=True)
                posterior = half.T @ w
                mean += p * posterior
                square += p * (posterior**2 + np.maximum(a * a * prior - np.square(half).sum(axis=0), 0.0))
        means.append(mean)
        sds.append(np.sqrt(np.maximum(square - mean**2, 0.0)))
    return np.concatenate(means), np.concatenate(sds)
