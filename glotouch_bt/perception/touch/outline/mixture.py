"""Mixture of outline hypotheses: predicted distances, their uncertainty, and the resulting contour."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glotouch_bt.perception.touch.outline.deviation import Hypothesis, ray_distances
from glotouch_bt.perception.touch.outline.polygons import (
    Indices,
    area_and_centroid,
    convex_hull,
    minimum_rectangle,
    polygon_distance,
    shrunk_convex,
    star_hull,
)
from glotouch_bt.perception.touch.outline.primitives import Touches, circle
from glotouch_bt.perception.touch.values import Contour, ContourFamily, ContourKind
from glotouch_bt.robot import Array

ROUND_CORNER_M = 0.006
"""Minimum corner radius at which a rectangle counts as a free outline; sharp corners would protrude by 0.41 of it."""
BOX_RATIO = 1.25
"""Minimum length over width of a free outline of kind "box" that fills its rectangle."""
BOX_FILL = 0.8
"""Minimum area over that of the rectangle for kind "box": an ellipse has 0.79, figures less."""
SLENDER_RATIO = 1.6
"""Length over width above which a free outline is always of kind "box"."""
MAX_ROUND_M = 0.080
"""Length above which a free outline is of kind "box": the jaws open 85 mm and cannot close along it."""
TEMPER = 0.5
"""Exponent of the evidence (tempering): residuals of neighbouring contacts are correlated, the model assumes not."""
BEARINGS = 72
"""Number of vertices of an outline: 5 degrees apart, 3 mm on an object 60 mm wide."""
RAYS = 5 * BEARINGS
"""Number of rays of the interpolation table. Its error is 0.02 mm where the prediction is smooth."""
USUAL_WIDTH_M = 0.076
"""Width up to which objects are usual. Source: the largest disc of the search (`search.remaining.USUAL`)."""
WIDE_NATS_PER_M = 500.0
"""Log evidence that each metre of a larger width costs: wide contacts are more often those of two objects than of one.
Source: ours."""
ACROSS = np.array([[math.cos(a), math.sin(a)] for a in np.arange(24) * math.pi / 24]).T
"""(2, 24) directions, 7.5 degrees apart, across which the width is measured: up to 0.2 % more than the least one."""


@dataclass(frozen=True)
class OutlineBelief:
    """Posterior over the outline of one object.

    Attributes:
        hypotheses: Hypotheses, most probable first.
        weights: (h,) their posterior probabilities.
        touches: The contacts, at the object's current position.
    """

    hypotheses: tuple[Hypothesis, ...]
    weights: Array
    touches: Touches

    @cached_property
    def log_evidence(self) -> float:
        """Log marginal likelihood of the contacts, and the prior of their width; compares groupings of contacts."""
        across_m = np.ptp(self.touches.current.tips_m @ ACROSS, axis=0) - 2.0 * self.touches.radius_m
        wide_m = max(float(across_m.min()) - USUAL_WIDTH_M, 0.0)
        return self.hypotheses[0].log_evidence - math.log(self.weights[0]) / TEMPER - WIDE_NATS_PER_M * wide_m

    @cached_property
    def family(self) -> ContourFamily:
        """The most probable family."""
        sums = self.family_weights
        return max(sums, key=lambda f: sums[f])

    @cached_property
    def family_weights(self) -> dict[ContourFamily, float]:
        """Posterior probability of each family."""
        sums: dict[ContourFamily, float] = {"circle": 0.0, "rectangle": 0.0, "free": 0.0}
        for h, w in zip(self.hypotheses, self.weights, strict=True):
            sums[_family(h)] += float(w)
        return sums

    @property
    def centre_K_m(self) -> Array:
        """(2,) centre of the contour; bearings are measured from here."""
        return self.contour.centre_K_m

    @cached_property
    def contour(self) -> Contour:
        """The contour of the most probable family."""
        family = self.family
        if family == "free":
            return self._free_contour()
        best = next(h for h in self.hypotheses if _family(h) == family)
        rms = float(np.sqrt(np.mean(best.residuals_m**2)))
        p, n = best.corrected, len(best.params)
        if family == "circle":
            size = (float(2 * p[2]), float(2 * p[2]))
            return Contour("round", p[:2], size, 0.0, rms, best.residuals_m, family, best.covariance[:n, :n])
        order = [0, 1, 2, 3, 4] if p[3] >= p[4] else [0, 1, 2, 4, 3]
        yaw = float(p[2]) + (0.0 if p[3] >= p[4] else 0.5 * math.pi)
        yaw = (yaw + 0.5 * math.pi) % math.pi - 0.5 * math.pi
        size, covariance = (float(2 * p[order[3]]), float(2 * p[order[4]])), best.covariance[np.ix_(order, order)]
        return Contour("box", p[:2], size, yaw, rms, best.residuals_m, family, covariance)

    @cached_property
    def centre_sd_m(self) -> Array:
        """(2,) standard deviation of the centre about `centre_K_m`, including disagreement between hypotheses."""
        means, covariances = self._middles
        off = means - self.centre_K_m
        second = np.einsum("h,hi->i", self.weights, off**2 + np.einsum("hii->hi", covariances))
        return np.asarray(np.sqrt(second))

    @cached_property
    def yaw_sd_rad(self) -> float:
        """Standard deviation of the contour's yaw; pi for kind "round"."""
        if self.contour.kind == "round":
            return math.pi
        if self.contour.family == "rectangle":
            return float(np.sqrt(self.contour.covariance[2, 2]))
        deviations = []
        for outline in self._samples(9):
            yaw = minimum_rectangle(outline)[2] - self.contour.yaw_rad
            deviations.append((yaw + 0.5 * math.pi) % math.pi - 0.5 * math.pi)
        return float(np.sqrt(np.mean(np.square(deviations))))

    def predict(self, bearing_rad: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation (n,) of the distance to the OFFSET outline along bearings (n,) rad.

        A ball that moves straight towards `centre_K_m` touches with its centre at this distance. Linear interpolation
        between RAYS precomputed bearings.
        """
        at = (np.asarray(bearing_rad, dtype=np.float64) + math.pi) * (RAYS / (2 * math.pi))
        whole = np.floor(at + 1e-9)
        part, first = at - whole, whole.astype(np.int64) % RAYS
        low, high = self._rays[:, first], self._rays[:, (first + 1) % RAYS]
        mean, sd = low + part * (high - low)
        return mean, sd

    @cached_property
    def _rays(self) -> Array:
        """(2, RAYS) mean and standard deviation of the distance along evenly spaced bearings from -pi."""
        mean, sd, weights = self._components(self.centre_K_m, np.linspace(-math.pi, math.pi, RAYS, endpoint=False))
        middle = weights @ mean
        return np.array([middle, np.sqrt(weights @ (sd**2 + (mean - middle) ** 2))])

    def _components(self, origin: Array, bearing: Array) -> tuple[Array, Array, Array]:
        """Return mean and standard deviation (h, n) of each hypothesis, and the weights (h,)."""
        means, sds = np.zeros((2, len(self.hypotheses), len(bearing)))
        for of, same in self._kinds:
            rays = ray_distances(same, origin, bearing)
            means[of], sds[of] = rays.mean_m, rays.sd_m(np.array([h.covariance for h in same]))
        return means, sds, self.weights

    @cached_property
    def _kinds(self) -> list[tuple[list[int], list[Hypothesis]]]:
        """Groups of hypotheses for `ray_distances`: their indices, and the hypotheses."""
        kinds: dict[tuple[bool, bool], list[int]] = {}
        for i, h in enumerate(self.hypotheses):
            kinds.setdefault((h.shape is circle, h.amplitude > 0), []).append(i)
        return [(of, [self.hypotheses[i] for i in of]) for of in kinds.values()]

    @cached_property
    def _middles(self) -> tuple[Array, Array]:
        """Centre (h, 2) of each hypothesis and its covariance (h, 2, 2)."""
        means = np.array([h.corrected[:2] for h in self.hypotheses])
        covariances = np.array([h.covariance[:2, :2] for h in self.hypotheses])
        u = _unit(_grid())
        for of, same in self._kinds:
            if same[0].amplitude == 0:
                continue
            rays = ray_distances(same, means[of], _grid())
            for i, h, distance, rows in zip(of, same, rays.mean_m, rays.rows, strict=True):
                outline = distance[:, None] * u
                corners = star_hull(outline)
                means[i] += area_and_centroid(shrunk_convex(outline[corners], self.touches.radius_m))[1]
                by = _centroid_by_distance(outline, u, corners) @ rows
                covariances[i] = by @ h.covariance @ by.T
        return means, covariances

    def _free_contour(self) -> Contour:
        """Return the mean outline of the free hypotheses."""
        free = np.array([_family(h) == "free" for h in self.hypotheses])
        weights = self.weights * free / float(self.weights @ free)
        origin = weights @ self._middles[0]
        bearing = _grid()
        distance = np.zeros(len(bearing))
        for of, same in self._kinds:
            if weights[of].any():
                distance += weights[of] @ ray_distances(same, origin, bearing).mean_m
        around = distance[:, None] * _unit(bearing)
        offset = origin + around
        hull = origin + shrunk_convex(around[star_hull(around)], self.touches.radius_m)
        boundary = _shrunk(offset, self.touches.radius_m)
        if len(hull) < 3 or len(boundary) < 8:
            boundary = hull = convex_hull(offset)
        area, centre = area_and_centroid(hull)
        _, size, yaw = minimum_rectangle(hull)
        means, covariances = self._middles
        off = means - centre
        covariance = np.einsum("h,hij->ij", weights, covariances + off[:, :, None] * off[:, None, :])
        residuals = polygon_distance(offset, self.touches.tips_m)
        rms = float(np.sqrt(np.mean(residuals**2)))
        kind: ContourKind = "box" if _boxlike(size, area) else "round"
        return Contour(kind, centre, size, yaw, rms, residuals, "free", covariance, boundary)

    def _samples(self, n: int) -> Array:
        """Draw offset outlines (n, BEARINGS, 2) from the most probable free hypothesis, with a fixed seed."""
        h = next(h for h in self.hypotheses if _family(h) == "free")
        bearing = _grid()
        rays = ray_distances([h], self.centre_K_m, bearing)
        mean, rows = rays.mean_m[0], rays.rows[0]
        root = np.linalg.cholesky(h.covariance + 1e-14 * np.eye(len(h.covariance)))
        draws = np.random.default_rng(0).normal(size=(n, len(root)))
        distance = np.maximum(mean + draws @ (rows @ root).T, 1e-3)
        return np.asarray(self.centre_K_m + distance[:, :, None] * _unit(bearing))


def _family(h: Hypothesis) -> ContourFamily:
    if h.shape is circle:
        return "circle" if h.amplitude == 0 else "free"
    return "rectangle" if h.amplitude == 0 and h.corrected[5] < ROUND_CORNER_M else "free"


def _boxlike(size: tuple[float, float], area: float) -> bool:
    ratio = size[0] / size[1]
    filled = ratio > BOX_RATIO and area > BOX_FILL * size[0] * size[1]
    return filled or ratio > SLENDER_RATIO or (size[0] > MAX_ROUND_M and ratio > 1.1)


def _shrunk(offset_outline: Array, r: float) -> Array:
    """Return the parallel curve (m, 2) at distance r inside an offset outline, without its loops."""
    tangent = np.roll(offset_outline, -1, axis=0) - np.roll(offset_outline, 1, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    inner = offset_outline - r * np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    depth = -polygon_distance(offset_outline, inner)
    return np.asarray(inner[depth > 0.93 * r])


def _centroid_by_distance(outline: Array, u: Array, corners: Indices) -> Array:
    """Return the derivative (2, n) of the hull's centroid by the distances of an outline (n, 2) along unit vectors u.

    Differentiates A = sum v x v' / 2 and M = sum (v x v') (v + v') / 6 over the hull's `corners` v and successors v'.
    """
    by = np.zeros((2, len(outline)))
    v, e = outline[corners], u[corners]
    after, before = np.roll(v, -1, axis=0), np.roll(v, 1, axis=0)
    cross, into = _cross(v, after), _cross(before, v)
    area = 0.5 * float(cross.sum())
    centroid = (cross[:, None] * (v + after)).sum(axis=0) / (6 * area)
    right, left = _cross(e, after), _cross(before, e)
    moment = (right[:, None] * (v + after) + left[:, None] * (before + v) + (cross + into)[:, None] * e) / 6
    by[:, corners] = ((moment - 0.5 * (right + left)[:, None] * centroid) / area).T
    return by


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _grid() -> Array:
    return np.linspace(-math.pi, math.pi, BEARINGS, endpoint=False)


def _unit(bearing: Array) -> Array:
    return np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
