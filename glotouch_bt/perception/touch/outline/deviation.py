"""A primitive with a smooth periodic deviation, and its rays.

The offset outline is displaced along the normal by g(t) = sum_h a_h cos(h t) + b_h sin(h t) at bearing t, with
independent normal coefficients (a periodic Gaussian process in weight space).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glotouch_bt.perception.touch.outline.primitives import (
    Shape,
    clipped,
    ray_m,
)
from glotouch_bt.robot import Array

HARMONICS = np.arange(1, 11)
"""Harmonics of the deviation."""
COEFFICIENT_SD_M = np.where(HARMONICS == 1, 0.001, 0.018 / HARMONICS**1.8)
"""Prior standard deviation of the cosine and sine coefficients about the best circle. Source: power law through 1500
random offset outlines (rectangles, ellipses, convex polygons, unions of discs, lobed rings; ball of 6 mm)."""
REST_SD_M = 0.0006
"""Standard deviation of such outlines beyond the last harmonic. Source: root mean square 0.7 mm."""
MIN_COSINE = 0.35
"""Minimum cosine between a ray and the normal; the linearisation is invalid below."""


@dataclass(frozen=True)
class Hypothesis:
    """One hypothesis about the outline.

    Attributes:
        shape: The primitive.
        params: (p,) parameters at the linearisation point; see `primitives`.
        amplitude: Scale of the deviation; 0 for none.
        mean, covariance: (n,), (n, n) posterior of the correction of `params`, followed by the coefficients if any.
        log_evidence: Log density of the contacts, up to a constant common to all hypotheses.
        residuals_m: (k,) residuals of the contacts at the posterior mean, outside positive.
        radius_m: Radius of the ball.
    """

    shape: Shape
    params: Array
    amplitude: float
    mean: Array
    covariance: Array
    log_evidence: float
    residuals_m: Array
    radius_m: float

    @cached_property
    def corrected(self) -> Array:
        """(p,) posterior mean of the primitive's parameters, clipped to the physical limits."""
        return np.asarray(clipped((self.params + self.mean[: len(self.params)])[None])[0])


@dataclass(frozen=True)
class Rays:
    """Predicted distances to the offset outline along rays (n), for hypotheses (h) of one kind.

    Attributes:
        mean_m: (h, n) expected distances.
        rows: (h, n, dim) Jacobian of the distances by corrections and coefficients.
        rest_m: (h, n) standard deviation beyond the last harmonic.
    """

    mean_m: Array
    rows: Array
    rest_m: Array

    def sd_m(self, covariance: Array) -> Array:
        """Return standard deviations (h, n) of the distances for covariances (h, dim, dim)."""
        square = ((self.rows @ covariance) * self.rows).sum(axis=2)
        return np.asarray(np.sqrt(np.maximum(square, 0.0) + self.rest_m**2))


def ray_distances(hypotheses: Sequence[Hypothesis], origin_m: Array, bearing_rad: Array) -> Rays:
    """Predict distances from `origin_m`, (2,) or (h, 2), along bearings (n,), for hypotheses of one kind: the same
    shape, and all plain or all with deviations."""
    shape, deviating, radius = hypotheses[0].shape, hypotheses[0].amplitude > 0, hypotheses[0].radius_m
    base = np.array([h.params if deviating else h.corrected for h in hypotheses])
    u = np.stack([np.cos(bearing_rad), np.sin(bearing_rad)], axis=1)
    mean = np.maximum(ray_m(base, radius, origin_m, u), 1e-3)
    place = np.reshape(origin_m, (-1, 1, 2)) + mean[..., None] * u
    g = shape(base, place)
    rows = -g.by_params
    slope = np.maximum((rows[..., 0] * u[:, 0] + rows[..., 1] * u[:, 1]), MIN_COSINE)[..., None]
    if not deviating:
        return Rays(mean, rows / slope, np.zeros_like(mean))
    off = place - base[:, None, :2]
    rows = np.concatenate([rows, _waves(np.arctan2(off[..., 1], off[..., 0]))], axis=2) / slope
    mean = mean + (rows @ np.array([h.mean for h in hypotheses])[..., None])[..., 0]
    rest = REST_SD_M * np.array([h.amplitude for h in hypotheses])[:, None] / slope[..., 0]
    return Rays(np.maximum(mean, 1e-3), rows, rest)


def _waves(bearing_rad: Array) -> Array:
    """Return cosines and sines (.., 2 h) of the harmonics."""
    first = np.cos(bearing_rad) + 1j * np.sin(bearing_rad)
    powers = np.repeat(first[..., None], len(HARMONICS), axis=-1).cumprod(axis=-1)
    return np.concatenate([powers.real, powers.imag], axis=-1)
