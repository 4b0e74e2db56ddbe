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
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.touch.primitives import FREE_SD_M, SMALLEST_M, Shape, Touches, circle, clipped, prior, ray_m, wrapped

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

    @property
    def corrected(self) -> Array:
        """(p,) posterior mean of the primitive's parameters; sizes within the physical limits."""
        return np.asarray(clipped((self.params + self.mean[: len(self.params)])[None])[0])

    def sd(self, rows: Array) -> Array:
        """(n,) standard deviation of the distances whose map (n, dim) `polar` gave, what no harmonic draws included."""
        slant = np.linalg.norm(rows[:, :2], axis=1) * self.amplitude * REST_SD_M
        return np.asarray(np.sqrt(np.maximum(np.sum((rows @ self.covariance) * rows, axis=1), 0.0) + slant**2))

    def polar(self, origin_m: Array, bearing_rad: Array) -> tuple[Array, Array]:
        """Mean (n,) and linear map (n, dim) of the distance from `origin_m` to the offset outline along bearings (n,).

        The map times `covariance` times its transpose is the distances' covariance.
        """
        base = self.params if self.amplitude > 0 else self.corrected
        u = np.stack([np.cos(bearing_rad), np.sin(bearing_rad)], axis=1)
        rho = np.maximum(ray_m(base, self.radius_m, origin_m, u), 1e-3)
        g = self.shape(base[None], origin_m + rho[:, None] * u)
        slope = -np.sum(g.by_params[0, :, :2] * u, axis=1)
        rows = -g.by_params[0]
        if self.amplitude > 0:
            points = origin_m + rho[:, None] * u - base[:2]
            rows = np.concatenate([rows, _waves(np.arctan2(points[:, 1], points[:, 0]))[0]], axis=1)
        rows = rows / np.maximum(slope, MIN_COSINE)[:, None]
        shift = rows @ self.mean if self.amplitude > 0 else 0.0
        return np.maximum(rho + shift, 1e-3), rows


def explain(shape: Shape, params: Array, amplitude: float, touches: Touches, looseness: float = 1.0) -> Hypothesis:
    """The posterior about one fitted primitive (p,), with deviations of the given amplitude; contacts scatter so many
    times as much as they are said to."""
    k, r = len(touches.tips_m), touches.radius_m
    points = np.concatenate([touches.tips_m, touches.free_m])
    g = shape(params[None], points)
    rows, turn = g.by_params[0], g.normal_by_params[0, :k]
    before, sd = prior(shape, touches)
    start = np.where(np.isfinite(sd), before - params, 0.0)
    sd = np.where(np.isfinite(sd), sd, math.sqrt(math.pi / 8))  # the density of a yaw anywhere in a quarter turn
    noise = np.full(k, looseness * touches.contact_sd_m)
    if shape is not circle:  # the normal turns with the place beside a corner only
        noise = np.where(
            np.any(g.normal_by_params[0, :k, :2] != 0.0, axis=1), np.maximum(noise, CORNER_CONTACT_SD_M), noise
        )
    if amplitude > 0:
        offset = points - params[:2]
        rho = np.maximum(np.linalg.norm(offset, axis=1), 0.5 * SMALLEST_M)
        bearing = np.arctan2(offset[:, 1], offset[:, 0])
        waves, slopes = _waves(bearing)
        cosine = np.maximum(np.cos(wrapped(g.normal_rad[0] - bearing)), MIN_COSINE)
        rows = np.concatenate([rows, -waves], axis=1)
        turn = np.concatenate([turn, -slopes[:k] * (cosine / rho)[:k, None]], axis=1)
        spread = amplitude * np.tile(COEFFICIENT_SD_M, 2)
        if shape is not circle:
            spread = np.minimum(spread, amplitude * COEFFICIENT_SD_M[2])
        sd = np.concatenate([sd, spread])
        start = np.concatenate([start, np.zeros(len(spread))])
        noise = np.hypot(noise, amplitude * REST_SD_M)
    if touches.strays:
        moved = np.where(np.arange(k) < touches.strays, 1.0, 0.0)[:, None]
        slide = np.zeros((len(points), 2))
        slide[:k] = -moved * g.by_params[0, :k, :2]
        rows = np.concatenate([rows, slide], axis=1)
        turn = np.concatenate([turn, -moved * g.normal_by_params[0, :k, :2]], axis=1)
        sd, start = np.concatenate([sd, [SHIFT_SD_M] * 2]), np.concatenate([start, [0.0, 0.0]])
    y = np.concatenate([r - g.distance_m[0, :k], wrapped(touches.normal_rad - g.normal_rad[0, :k])])
    h = np.concatenate([rows[:k], turn])
    inverse_sd = np.concatenate([1.0 / noise, 1.0 / touches.normal_sd_rad])
    y, h = y * inverse_sd, h * inverse_sd[:, None]
    beyond, free_rows = (r - g.distance_m[0, k:]) / FREE_SD_M, rows[k:] / FREE_SD_M
    precision = np.diag(1.0 / sd**2) + h.T @ h
    vector = start / sd**2 + h.T @ y
    constant = float(y @ y + np.sum((start / sd) ** 2))
    active = np.zeros(len(beyond), dtype=bool)
    mean = np.linalg.solve(precision, vector)
    full, right, square = precision, vector, constant
    for _ in range(4):
        inside = free_rows @ mean < beyond
        if bool(np.all(inside <= active)):
            break
        active |= inside
        a, b = free_rows[active], beyond[active]
        full, right, square = precision + a.T @ a, vector + a.T @ b, constant + float(b @ b)
        mean = np.linalg.solve(full, right)
    covariance = np.linalg.inv(full)
    determinant = float(np.linalg.slogdet(full)[1]) + 2.0 * float(np.sum(np.log(sd)))
    fit = max(square - float(right @ mean), 0.0)
    evidence = -0.5 * fit - 0.5 * determinant - float(np.sum(np.log(noise)))
    outwards = np.stack([np.cos(g.normal_rad[0, :k]), np.sin(g.normal_rad[0, :k])], axis=1)
    evidence -= 10.0 * float(np.sum(np.sum(outwards * touches.approach, axis=1) > 0.3))
    residuals = g.distance_m[0, :k] - r + rows[:k] @ mean
    if touches.strays:
        mean, covariance = mean[:-2], covariance[:-2, :-2]
    return Hypothesis(shape, params, amplitude, mean, covariance, evidence, residuals, r)


def _waves(bearing_rad: Array) -> tuple[Array, Array]:
    """(n, 2 h) cosines and sines of the harmonics, and their derivatives by the bearing."""
    phase = bearing_rad[:, None] * HARMONICS
    c, s = np.cos(phase), np.sin(phase)
    return np.concatenate([c, s], axis=1), np.concatenate([-HARMONICS * s, HARMONICS * c], axis=1)
