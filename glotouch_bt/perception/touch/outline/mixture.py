"""A mixture of explanations of one object's contacts: what it predicts, and the outline it comes to.

Where the explanations disagree, the outline is uncertain, and that is where to touch next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from glotouch_bt.perception.touch.outline.deviation import Hypothesis, polar
from glotouch_bt.perception.touch.outline.polygons import (
    Indices,
    area_and_centroid,
    convex_hull,
    minimum_rectangle,
    polygon_distance,
    shrunk_convex,
    star_hull,
)
from glotouch_bt.perception.touch.outline.primitives import Touches, circle, wrapped
from glotouch_bt.perception.touch.values import Contour, ContourFamily, ContourKind
from glotouch_bt.robot import Array

ROUND_CORNER_M = 0.006
"""A rectangle with rounder corners is a free outline: sharp ones would stick out by 0.41 of their radius."""
BOX_RATIO, BOX_FILL, SLENDER_RATIO, WIDEST_M = 1.25, 0.8, 1.6, 0.080
"""When a free outline is squeezed like a box, in three parallel tracks across its long side, instead of from three
directions like something round: if it is BOX_RATIO longer than wide and its hull fills BOX_FILL of its rectangle (a
figure fills less, an ellipse 0.79), or if it is slender, or too long for jaws that open 85 mm to close across."""
TEMPER = 0.5
"""Power of the evidence: every hypothesis takes its misfit for independent from contact to contact, which it is not."""
BEARINGS = 72
"""Rays an outline is drawn with: 5 degrees apart, 3 mm on an object 60 mm wide."""
RAYS = 5 * BEARINGS
"""Rays a prediction is interpolated between: to 0.02 mm where it is smooth; at the end of a slender box with deviations
it leaps, by a millimetre or two, and the leap becomes a degree wide."""


@dataclass(frozen=True)
class OutlineBelief:
    """A mixture of explanations of one object's contacts.

    Attributes:
        hypotheses: The explanations, weightiest first.
        weights: (h,) their posterior probabilities, summing to 1.
        touches: What they explain, where the object stands now.
    """

    hypotheses: tuple[Hypothesis, ...]
    weights: Array
    touches: Touches

    @cached_property
    def log_evidence(self) -> float:
        """Log density of the contacts, averaged over families; for comparing ways to group the same contacts."""
        return self.hypotheses[0].log_evidence - math.log(self.weights[0]) / TEMPER

    @cached_property
    def family(self) -> ContourFamily:
        """The family of most weight."""
        sums = self.family_weights
        return max(sums, key=lambda f: sums[f])

    @cached_property
    def family_weights(self) -> dict[ContourFamily, float]:
        """Probability of each family."""
        sums: dict[ContourFamily, float] = {"circle": 0.0, "rectangle": 0.0, "free": 0.0}
        for h, w in zip(self.hypotheses, self.weights, strict=True):
            sums[_family(h)] += float(w)
        return sums

    @property
    def centre_K_m(self) -> Array:
        """(2,) the contour's centre: bearings are taken from here."""
        return self.contour.centre_K_m

    @cached_property
    def contour(self) -> Contour:
        """The outline of the family of most weight."""
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
        return Contour(
            "box",
            p[:2],
            (float(2 * p[order[3]]), float(2 * p[order[4]])),
            (yaw + 0.5 * math.pi) % math.pi - 0.5 * math.pi,
            rms,
            best.residuals_m,
            family,
            best.covariance[np.ix_(order, order)],
        )

    @cached_property
    def centre_sd_m(self) -> Array:
        """(2,) standard deviation of the object's middle about `centre_K_m`, families' disagreement included."""
        means, covariances = self._middles
        off = means - self.centre_K_m
        second = np.einsum("h,hi->i", self.weights, off**2 + np.einsum("hii->hi", covariances))
        return np.asarray(np.sqrt(second))

    @cached_property
    def yaw_sd_rad(self) -> float:
        """Standard deviation of the contour's yaw; pi for what is round."""
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
        """Mean and standard deviation (n,) of the distance from `centre_K_m` to the OFFSET outline along bearings (n,).

        The ball's centre, coming straight towards `centre_K_m`, is expected there at the contact. Worked out once for
        RAYS bearings, and between them by linear interpolation.
        """
        at = (np.asarray(bearing_rad, dtype=np.float64) + math.pi) * (RAYS / (2 * math.pi))
        whole = np.floor(at + 1e-9)
        part, first = at - whole, whole.astype(np.int64) % RAYS
        low, high = self._rays[:, first], self._rays[:, (first + 1) % RAYS]
        mean, sd = low + part * (high - low)
        return mean, sd

    @cached_property
    def _rays(self) -> Array:
        """(2, RAYS) mean and standard deviation of the distance along evenly spaced bearings from -pi on."""
        mean, sd, weights = self._components(self.centre_K_m, np.linspace(-math.pi, math.pi, RAYS, endpoint=False))
        middle = weights @ mean
        return np.array([middle, np.sqrt(weights @ (sd**2 + (mean - middle) ** 2))])

    def offset_path_K_m(self, n: int = BEARINGS, *, sds: float = 0.0) -> Array:
        """(n + 1, 2) closed polyline of the predicted offset outline, `sds` standard deviations further out."""
        bearing = np.linspace(-math.pi, math.pi, n + 1)
        distance, sd = self.predict(bearing)
        return np.asarray(self.centre_K_m + (distance + sds * sd)[:, None] * _unit(bearing))

    def extent_m(self, yaw_rad: float) -> tuple[float, float, float]:
        """(least, greatest, sd of the worse known end) coordinate of the object along a direction in K."""
        axis = np.array([math.cos(yaw_rad), math.sin(yaw_rad)])
        bearing = _grid()
        distance, sd = self.predict(bearing)
        along = (self.centre_K_m + distance[:, None] * _unit(bearing)) @ axis
        low, high = int(np.argmin(along)), int(np.argmax(along))
        worse = max(sd[i] * abs(float(_unit(bearing[i : i + 1])[0] @ axis)) for i in (low, high))
        r = self.touches.radius_m
        return float(along[low]) + r, float(along[high]) - r, worse

    def plausibility(self, tip_K_m: Array) -> float:
        """Two-sided tail probability of a further contact at `tip_K_m` (2,): small if it belongs to something else,
        or the object has moved."""
        off = np.asarray(tip_K_m, dtype=np.float64)[:2] - self.centre_K_m
        mean, sd, weights = self._components(self.centre_K_m, np.array([math.atan2(off[1], off[0])]))
        spread = np.hypot(sd[:, 0], 1.5 * self.touches.contact_sd_m)
        below = float(weights @ scipy.special.ndtr((float(np.linalg.norm(off)) - mean[:, 0]) / spread))
        return 2.0 * min(below, 1.0 - below)

    def _components(self, origin: Array, bearing: Array) -> tuple[Array, Array, Array]:
        """Each hypothesis' mean and sd (h, n), and the weights (h,)."""
        means, sds = np.zeros((2, len(self.hypotheses), len(bearing)))
        for of, same in self._kinds:
            rays = polar(same, origin, bearing)
            means[of], sds[of] = rays.mean_m, rays.sd_m(np.array([h.covariance for h in same]))
        return means, sds, self.weights

    @cached_property
    def _kinds(self) -> list[tuple[list[int], list[Hypothesis]]]:
        """The hypotheses that `polar` takes together, with their places."""
        kinds: dict[tuple[bool, bool], list[int]] = {}
        for i, h in enumerate(self.hypotheses):
            kinds.setdefault((h.shape is circle, h.amplitude > 0), []).append(i)
        return [(of, [self.hypotheses[i] for i in of]) for of in kinds.values()]

    @cached_property
    def _middles(self) -> tuple[Array, Array]:
        """Each hypothesis' middle (h, 2) and its covariance (h, 2, 2)."""
        means = np.array([h.corrected[:2] for h in self.hypotheses])
        covariances = np.array([h.covariance[:2, :2] for h in self.hypotheses])
        u = _unit(_grid())
        for of, same in self._kinds:
            if same[0].amplitude == 0:
                continue
            rays = polar(same, means[of], _grid())
            for i, h, distance, rows in zip(of, same, rays.mean_m, rays.rows, strict=True):
                outline = distance[:, None] * u
                corners = star_hull(outline)
                means[i] += area_and_centroid(shrunk_convex(outline[corners], self.touches.radius_m))[1]
                by = _centroid_by_distance(outline, u, corners) @ rows
                covariances[i] = by @ h.covariance @ by.T
        return means, covariances

    def _free_contour(self) -> Contour:
        """The free hypotheses' mean outline; see `Contour`."""
        free = np.array([_family(h) == "free" for h in self.hypotheses])
        weights = self.weights * free / float(self.weights @ free)
        origin = weights @ self._middles[0]
        bearing = _grid()
        distance = np.zeros(len(bearing))
        for of, same in self._kinds:
            if weights[of].any():
                distance += weights[of] @ polar(same, origin, bearing).mean_m
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
        """(n, BEARINGS, 2) offset outlines drawn from the free hypothesis of most weight; always the same draws."""
        h = next(h for h in self.hypotheses if _family(h) == "free")
        bearing = _grid()
        rays = polar([h], self.centre_K_m, bearing)
        mean, rows = rays.mean_m[0], rays.rows[0]
        root = np.linalg.cholesky(h.covariance + 1e-14 * np.eye(len(h.covariance)))
        draws = np.random.default_rng(0).normal(size=(n, len(root)))
        distance = np.maximum(mean + draws @ (rows @ root).T, 1e-3)
        return np.asarray(self.centre_K_m + distance[:, :, None] * _unit(bearing))


def informative_direction(
    belief: OutlineBelief,
    *,
    here_K_m: Array | None = None,
    blocked_rad: Array | None = None,
    apart_rad: float = math.radians(15.0),
) -> float:
    """Bearing from the belief's centre, rad in [-pi, pi), along which the outline is least certain.

    Args:
        belief: After at least one contact.
        here_K_m: (2,) where the ball is: among bearings within a tenth of the largest uncertainty, the nearest.
        blocked_rad: Bearings that were tried and cannot be reached; none within `apart_rad` of them is proposed,
            unless that leaves nothing.
        apart_rad: See above.
    """
    bearing = _grid()
    _, sd = belief.predict(bearing)
    blocked = np.zeros(0) if blocked_rad is None else np.asarray(blocked_rad, dtype=np.float64).ravel()
    if len(blocked):
        near = np.min(np.abs(wrapped(bearing[:, None] - blocked)), axis=1) < apart_rad
        sd = np.where(near, -1.0, sd) if not bool(near.all()) else sd
    if here_K_m is None:
        return float(bearing[int(np.argmax(sd))])
    off = np.asarray(here_K_m, dtype=np.float64)[:2] - belief.centre_K_m
    turn = np.abs(wrapped(bearing - math.atan2(off[1], off[0])))
    return float(bearing[int(np.argmin(np.where(sd >= 0.9 * sd.max(), turn, np.inf)))])


def _family(h: Hypothesis) -> ContourFamily:
    if h.shape is circle:
        return "circle" if h.amplitude == 0 else "free"
    return "rectangle" if h.amplitude == 0 and h.corrected[5] < ROUND_CORNER_M else "free"


def _boxlike(size: tuple[float, float], area: float) -> bool:
    ratio = size[0] / size[1]
    filled = ratio > BOX_RATIO and area > BOX_FILL * size[0] * size[1]
    return filled or ratio > SLENDER_RATIO or (size[0] > WIDEST_M and ratio > 1.1)


def _shrunk(offset_outline: Array, r: float) -> Array:
    """The outline (m, 2) whose offset by r is given: its parallel curve, without the loops that run too near."""
    tangent = np.roll(offset_outline, -1, axis=0) - np.roll(offset_outline, 1, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    inner = offset_outline - r * np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    depth = -polygon_distance(offset_outline, inner)
    return np.asarray(inner[depth > 0.93 * r])


def _centroid_by_distance(outline: Array, u: Array, corners: Indices) -> Array:
    """(2, n) derivative of the hull's area centroid by the distances of an outline (n, 2) along unit vectors u (n, 2);
    the hull's corners are given.

    Of A = sum v x v' / 2 and M = sum (v x v') (v + v') / 6 over the hull's corners v and the following ones v'.
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
