"""A primitive with a smooth periodic deviation: Gaussian posterior and evidence in closed form.

The offset outline is displaced along the normal by g(t) = sum_h a_h cos(h t) + b_h sin(h t) at bearing t, with
independent normal coefficients (a periodic Gaussian process in weight space). Linearised at the fitted primitive, the
observations are linear in x = (correction dp of the parameters, coefficients w):

    contact         distance + J dp - phi(t) w         = ball radius + noise
    reaction        normal + J_n dp - phi'(t) w / rho  = its bearing + noise
    free position   like a contact, but one-sided: active only while the outline would cover it

So the posterior is a ridge regression and the evidence a determinant. Without coefficients it is the plain primitive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from glotouch_bt.perception.touch.outline.primitives import (
    FREE_SD_M,
    MIN_SIZE_M,
    Geometry,
    Shape,
    Touches,
    circle,
    clipped,
    prior,
    ray_m,
    wrapped,
)
from glotouch_bt.robot import Array

CORNER_CONTACT_SD_M = 0.0012
"""Minimum standard deviation of a contact at a corner. A recess of a real object looks like a corner and would
fix an untouched end."""
SHIFT_SD_M = 0.008
"""Prior standard deviation of an unobserved displacement of the object, per axis."""
HARMONICS = np.arange(1, 11)
"""Harmonics of the deviation."""
COEFFICIENT_SD_M = np.where(HARMONICS == 1, 0.001, 0.018 / HARMONICS**1.8)
"""Prior standard deviation of the cosine and sine coefficients about the best circle. Source: power law through 1500
random offset outlines (rectangles, ellipses, convex polygons, unions of discs, lobed rings; ball of 6 mm)."""
REST_SD_M = 0.0006
"""Standard deviation of such outlines beyond the last harmonic. Source: root mean square 0.7 mm."""
MAX_MISFIT_INCREASE = 1.0
"""Maximum increase of the squared misfit by a correction, in variances; rounded corners cause about this much."""
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
    rows = np.concatenate([rows, _waves(np.arctan2(off[..., 1], off[..., 0]))[0]], axis=2) / slope
    mean = mean + (rows @ np.array([h.mean for h in hypotheses])[..., None])[..., 0]
    rest = REST_SD_M * np.array([h.amplitude for h in hypotheses])[:, None] / slope[..., 0]
    return Rays(np.maximum(mean, 1e-3), rows, rest)


def infer_posteriors(
    shape: Shape, params: Array, amplitudes: Sequence[float], touches: Touches, scatter_scales: Sequence[float] = (1.0,)
) -> list[Hypothesis]:
    """Compute the posteriors at fitted primitives, all at once.

    Args:
        shape: The primitive.
        params: (s, p) linearisation points.
        amplitudes: Amplitudes of the deviations, (s,); all zero or all positive.
        touches: The contacts.
        scatter_scales: Factors on the contacts' standard deviation, (s,) or one for all.
    """
    s, k, r = len(params), len(touches.tips_m), touches.radius_m
    amplitude, deviating = np.asarray(amplitudes, dtype=np.float64)[:, None], amplitudes[0] > 0
    g = shape(params, touches.points_m)
    rows, turn = g.by_params, g.normal_by_params[:, :k]
    towards = np.moveaxis(np.array([rows[:, :k, :2], turn[..., :2]]), 0, 1)
    before, sd = prior(shape, touches)
    start = np.where(np.isfinite(sd), before - params, 0.0)
    sd = np.where(np.isfinite(sd), sd, math.sqrt(math.pi / 8))  # the density of a yaw anywhere in a quarter turn
    sd = np.repeat(sd[None], s, axis=0)
    noise = np.asarray(scatter_scales, dtype=np.float64)[:, None] * np.full((s, k), touches.contact_sd_m)
    if shape is not circle:  # a position-dependent normal marks a corner
        beside = np.any(turn[..., :2] != 0.0, axis=2)
        noise = np.where(beside, np.maximum(noise, CORNER_CONTACT_SD_M), noise)
    if deviating:
        off = touches.points_m - params[:, None, :2]
        rho = np.maximum(np.sqrt((off * off).sum(axis=2)), 0.5 * MIN_SIZE_M)
        bearing = np.arctan2(off[..., 1], off[..., 0])
        waves, slopes = _waves(bearing)
        cosine = np.maximum(np.cos(g.normal_rad - bearing), MIN_COSINE)
        rows = np.concatenate([rows, -waves], axis=2)
        turn = np.concatenate([turn, -slopes[:, :k] * (cosine / rho)[:, :k, None]], axis=2)
        spread = COEFFICIENT_SD_M if shape is circle else np.minimum(COEFFICIENT_SD_M, COEFFICIENT_SD_M[2])
        sd = np.concatenate([sd, amplitude * np.tile(spread, 2)], axis=1)
        start = np.concatenate([start, np.zeros((s, 2 * len(spread)))], axis=1)
        noise = np.hypot(noise, amplitude * REST_SD_M)
    if touches.outliers:
        moved = np.where(np.arange(k) < touches.outliers, 1.0, 0.0)[:, None]
        slide = np.zeros((s, len(touches.points_m), 2))
        slide[:, :k] = -moved * towards[:, 0]
        rows = np.concatenate([rows, slide], axis=2)
        turn = np.concatenate([turn, -moved * towards[:, 1]], axis=2)
        sd = np.concatenate([sd, np.full((s, 2), SHIFT_SD_M)], axis=1)
        start = np.concatenate([start, np.zeros((s, 2))], axis=1)
    seen = _Observations.of(rows, turn, g, noise, touches)
    posterior = _condition(seen, start, sd)
    evidence = posterior.log_density - np.log(noise).sum(axis=1)
    # Penalise a contact on a face whose normal points along the approach: the ball would have come from inside.
    evidence -= 10.0 * (-(g.by_params[:, :k, :2] * touches.approach).sum(axis=2) > 0.3).sum(axis=1)
    if not deviating and not touches.outliers:
        posterior = replace(posterior, mean=_limit(shape, params, posterior.mean, start, sd, noise, touches))
    residuals = g.distance_m[:, :k] - r + (rows[:, :k] @ posterior.mean[..., None])[..., 0]
    own = posterior.mean.shape[1] - (2 if touches.outliers else 0)
    mean, covariance = posterior.mean[:, :own], posterior.covariance[:, :own, :own]
    return [
        Hypothesis(
            shape, params[i], float(amplitude[i, 0]), mean[i], covariance[i], float(evidence[i]), residuals[i], r
        )
        for i in range(s)
    ]


def _limit(shape: Shape, params: Array, mean: Array, start: Array, sd: Array, noise: Array, touches: Touches) -> Array:
    """Scale each correction (s, p) down until it explains the contacts about as well as no correction.

    The linearisation ignores that a side must reach as far as its contacts, so the prior could pull an untouched end in
    past them.
    """

    def misfit(correction: Array) -> Array:
        gap = (shape(clipped(params + correction), touches.tips_m).distance_m - touches.radius_m) / noise
        return np.asarray((gap * gap).sum(axis=1) + (((correction - start) / sd) ** 2).sum(axis=1))

    kept = mean.copy()
    limit = misfit(np.zeros_like(mean)) + MAX_MISFIT_INCREASE
    for share in (0.5, 0.25, 0.0):
        worse = misfit(kept) > limit
        if not worse.any():
            break
        kept[worse] = share * mean[worse]
    return kept


@dataclass(frozen=True)
class _Observations:
    """Whitened observations: h x = y of contacts and normals (s, 2 k, ..), and b x >= beyond of free positions
    (s, m, ..)."""

    h: Array
    y: Array
    b: Array
    beyond: Array

    @classmethod
    def of(cls, rows: Array, turn: Array, g: Geometry, noise: Array, touches: Touches) -> _Observations:
        k, r = len(touches.tips_m), touches.radius_m
        sharp = np.concatenate([1.0 / noise, np.broadcast_to(1.0 / touches.normal_sd_rad, noise.shape)], axis=1)
        y = np.concatenate([r - g.distance_m[:, :k], wrapped(touches.normal_rad - g.normal_rad[:, :k])], axis=1)
        h = np.concatenate([rows[:, :k], turn], axis=1)
        return cls(h * sharp[..., None], y * sharp, rows[:, k:] / FREE_SD_M, (r - g.distance_m[:, k:]) / FREE_SD_M)


@dataclass(frozen=True)
class _Posterior:
    mean: Array
    covariance: Array
    log_density: Array


def _condition(seen: _Observations, start: Array, sd: Array) -> _Posterior:
    """Condition normal coefficients (s, n) of mean `start` and standard deviation `sd` on the observations. A free
    position becomes active once the outline would cover it, and stays active."""
    weight = sd**-2
    back = np.swapaxes(seen.h, 1, 2)
    full = np.asarray(back @ seen.h)
    diagonal = np.arange(full.shape[-1])
    full[:, diagonal, diagonal] += weight
    right = start * weight + (back @ seen.y[..., None])[..., 0]
    square = (seen.y * seen.y).sum(axis=1) + (start * start * weight).sum(axis=1)
    mean = np.linalg.solve(full, right[..., None])[..., 0]
    active = np.zeros(seen.beyond.shape, dtype=bool)
    for _ in range(4 if seen.beyond.size else 0):
        new = ((seen.b @ mean[..., None])[..., 0] < seen.beyond) & ~active
        if not new.any():
            break
        active |= new
        only = np.swapaxes(seen.b * new[..., None], 1, 2)
        full, right = full + only @ seen.b, right + (only @ seen.beyond[..., None])[..., 0]
        square = square + (seen.beyond * seen.beyond * new).sum(axis=1)
        mean = np.linalg.solve(full, right[..., None])[..., 0]
    determinant = np.linalg.slogdet(full)[1] + 2.0 * np.log(sd).sum(axis=1)
    misfit = np.maximum(square - (right * mean).sum(axis=1), 0.0)
    return _Posterior(np.asarray(mean), np.asarray(np.linalg.inv(full)), np.asarray(-0.5 * (misfit + determinant)))


def _waves(bearing_rad: Array) -> tuple[Array, Array]:
    """Return cosines and sines (.., 2 h) of the harmonics, and their derivatives by the bearing (..)."""
    first = np.cos(bearing_rad) + 1j * np.sin(bearing_rad)
    powers = np.repeat(first[..., None], len(HARMONICS), axis=-1).cumprod(axis=-1)
    c, s = powers.real, powers.imag
    return np.concatenate([c, s], axis=-1), np.concatenate([-HARMONICS * s, HARMONICS * c], axis=-1)
