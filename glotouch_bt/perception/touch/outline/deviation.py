"""A primitive plus a smooth periodic deviation, seen through contacts: Gaussian posterior and evidence in closed form.

The offset outline is the primitive's, displaced along its normal by g(bearing) = sum_h a_h cos(h t) + b_h sin(h t) with
independent normal coefficients (a periodic Gaussian process in its weight space). Near the fitted primitive everything
observed is linear in x = (parameters' correction, coefficients):

    contact       distance + J dp - phi(t) w         = ball's radius, +- its scatter
    reaction      normal + J_n dp - phi'(t) w / rho  = its bearing, +- its scatter
    free place    as a contact, one-sided: counted only while the outline would lie beyond it

so the posterior is a ridge regression and the evidence a determinant. With all coefficients zero it is the primitive
alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from glotouch_bt.perception.touch.outline.primitives import (
    FREE_SD_M,
    SMALLEST_M,
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
"""Least scatter of a contact beside a corner: a recess or a nose of a real thing looks like a corner, and would fix an
end that nobody touched."""
SHIFT_SD_M = 0.008
"""How far an object is shoved unseen, if it is, along x and along y."""
HARMONICS = np.arange(1, 11)
COEFFICIENT_SD_M = np.where(HARMONICS == 1, 0.001, 0.018 / HARMONICS**1.8)
"""Spread of the coefficients of cos and sin about the best circle: power law through the root mean squares of 1500
random offset outlines (rectangles, ellipses, convex polygons, unions of discs, lobed rings; ball of 6 mm)."""
REST_SD_M = 0.0006
"""What such outlines keep beyond the last harmonic, root mean square 0.7 mm."""
UPHELD = 1.0
"""A correction may raise the squared misfit, in standard deviations, by so much: what rounding corners does to it."""
MIN_COSINE = 0.35
"""A ray is taken to meet the outline no more obliquely than this: beyond, the linear picture says nothing."""


@dataclass(frozen=True)
class Hypothesis:
    """One explanation of the contacts.

    Attributes:
        shape: The primitive.
        params: (p,) its parameters at which everything is linearised; see `primitives`.
        amplitude: Scale of the deviations' spread; 0 for none.
        mean, covariance: (n,), (n, n) posterior of the correction of `params`, followed by the coefficients if any.
        log_evidence: Log density of the contacts, up to a constant common to all hypotheses about them.
        residuals_m: (k,) what the contacts leave of the posterior mean, outside positive.
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
        """(p,) posterior mean of the primitive's parameters; sizes within the physical limits."""
        return np.asarray(clipped((self.params + self.mean[: len(self.params)])[None])[0])


@dataclass(frozen=True)
class Rays:
    """What hypotheses (h) of one kind say about the distance to the offset outline along rays (n).

    Attributes:
        mean_m: (h, n) expected distances.
        rows: (h, n, dim) how they follow from the hypotheses' corrections and coefficients: between them and the
            hypotheses' covariances, rows @ covariance @ rows' is the distances'.
        rest_m: (h, n) standard deviation of what no harmonic draws.
    """

    mean_m: Array
    rows: Array
    rest_m: Array

    def sd_m(self, covariance: Array) -> Array:
        """(h, n) standard deviations of the distances, of the hypotheses' covariances (h, dim, dim)."""
        square = ((self.rows @ covariance) * self.rows).sum(axis=2)
        return np.asarray(np.sqrt(np.maximum(square, 0.0) + self.rest_m**2))


def polar(hypotheses: Sequence[Hypothesis], origin_m: Array, bearing_rad: Array) -> Rays:
    """Distances from `origin_m`, (2,) or one each (h, 2), along bearings (n,), of hypotheses of one kind: the same
    shape, and all plain or all with deviations."""
    shape, wavy, radius = hypotheses[0].shape, hypotheses[0].amplitude > 0, hypotheses[0].radius_m
    base = np.array([h.params if wavy else h.corrected for h in hypotheses])
    u = np.stack([np.cos(bearing_rad), np.sin(bearing_rad)], axis=1)
    mean = np.maximum(ray_m(base, radius, origin_m, u), 1e-3)
    place = np.reshape(origin_m, (-1, 1, 2)) + mean[..., None] * u
    g = shape(base, place)
    rows = -g.by_params
    slope = np.maximum((rows[..., 0] * u[:, 0] + rows[..., 1] * u[:, 1]), MIN_COSINE)[..., None]
    if not wavy:
        return Rays(mean, rows / slope, np.zeros_like(mean))
    off = place - base[:, None, :2]
    rows = np.concatenate([rows, _waves(np.arctan2(off[..., 1], off[..., 0]))[0]], axis=2) / slope
    mean = mean + (rows @ np.array([h.mean for h in hypotheses])[..., None])[..., 0]
    rest = REST_SD_M * np.array([h.amplitude for h in hypotheses])[:, None] / slope[..., 0]
    return Rays(np.maximum(mean, 1e-3), rows, rest)


def explain(
    shape: Shape, params: Array, amplitudes: Sequence[float], touches: Touches, looseness: Sequence[float] = (1.0,)
) -> list[Hypothesis]:
    """The posteriors about fitted primitives, all computed at once.

    Args:
        shape: The primitive.
        params: (s, p) where each is linearised.
        amplitudes: Of the deviations, one each; all zero, or none.
        touches: What is to be explained.
        looseness: Contacts scatter so many times as much as they are said to; one each, or one for all.
    """
    s, k, r = len(params), len(touches.tips_m), touches.radius_m
    amplitude, wavy = np.asarray(amplitudes, dtype=np.float64)[:, None], amplitudes[0] > 0
    g = shape(params, touches.points_m)
    rows, turn = g.by_params, g.normal_by_params[:, :k]
    towards = np.moveaxis(np.array([rows[:, :k, :2], turn[..., :2]]), 0, 1)
    before, sd = prior(shape, touches)
    start = np.where(np.isfinite(sd), before - params, 0.0)
    sd = np.where(np.isfinite(sd), sd, math.sqrt(math.pi / 8))  # the density of a yaw anywhere in a quarter turn
    sd = np.repeat(sd[None], s, axis=0)
    noise = np.asarray(looseness, dtype=np.float64)[:, None] * np.full((s, k), touches.contact_sd_m)
    if shape is not circle:  # the normal turns with the place beside a corner only
        beside = np.any(turn[..., :2] != 0.0, axis=2)
        noise = np.where(beside, np.maximum(noise, CORNER_CONTACT_SD_M), noise)
    if wavy:
        off = touches.points_m - params[:, None, :2]
        rho = np.maximum(np.sqrt((off * off).sum(axis=2)), 0.5 * SMALLEST_M)
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
    seen = _Seen.of(rows, turn, g, noise, touches)
    posterior = _condition(seen, start, sd)
    evidence = posterior.log_density - np.log(noise).sum(axis=1)
    # A contact on a face that looks along its approach would have been made from inside.
    evidence -= 10.0 * (-(g.by_params[:, :k, :2] * touches.approach).sum(axis=2) > 0.3).sum(axis=1)
    if not wavy and not touches.outliers:
        posterior = replace(posterior, mean=_upheld(shape, params, posterior.mean, start, sd, noise, touches))
    residuals = g.distance_m[:, :k] - r + (rows[:, :k] @ posterior.mean[..., None])[..., 0]
    own = posterior.mean.shape[1] - (2 if touches.outliers else 0)
    return [
        Hypothesis(
            shape,
            params[i],
            float(amplitude[i, 0]),
            posterior.mean[i, :own],
            posterior.covariance[i, :own, :own],
            float(evidence[i]),
            residuals[i],
            r,
        )
        for i in range(s)
    ]


def _upheld(shape: Shape, params: Array, mean: Array, start: Array, sd: Array, noise: Array, touches: Touches) -> Array:
    """Corrections (s, p), each cut back as far as it must be to explain the contacts as well as none does.

    The linear picture does not know that a side must reach as far as its contacts do: the prior would pull an end that
    nothing touched in past them.
    """

    def misfit(correction: Array) -> Array:
        gap = (shape(clipped(params + correction), touches.tips_m).distance_m - touches.radius_m) / noise
        return np.asarray((gap * gap).sum(axis=1) + (((correction - start) / sd) ** 2).sum(axis=1))

    kept = mean.copy()
    most = misfit(np.zeros_like(mean)) + UPHELD
    for share in (0.5, 0.25, 0.0):
        worse = misfit(kept) > most
        if not worse.any():
            break
        kept[worse] = share * mean[worse]
    return kept


@dataclass(frozen=True)
class _Seen:
    """Observations, each divided by its scatter: h x = y of contacts and normals (s, 2 k, ..), and b x >= beyond of
    free places (s, m, ..)."""

    h: Array
    y: Array
    b: Array
    beyond: Array

    @classmethod
    def of(cls, rows: Array, turn: Array, g: Geometry, noise: Array, touches: Touches) -> _Seen:
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


def _condition(seen: _Seen, start: Array, sd: Array) -> _Posterior:
    """Normal coefficients (s, n) of mean `start` and scatter `sd` given what was seen; a free place counts once the
    outline would lie beyond it, and from then on."""
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
    """(.., 2 h) cosines and sines of the harmonics, and their derivatives by the bearing (..)."""
    first = np.cos(bearing_rad) + 1j * np.sin(bearing_rad)
    powers = np.repeat(first[..., None], len(HARMONICS), axis=-1).cumprod(axis=-1)
    c, s = powers.real, powers.imag
    return np.concatenate([c, s], axis=-1), np.concatenate([-HARMONICS * s, HARMONICS * c], axis=-1)
