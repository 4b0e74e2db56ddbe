"""What the contacts made so far say about an object's outline: hypotheses, each with a posterior, weighted by evidence.

Circle, oriented rectangle (every distinct optimum), and either with smooth deviations (the "free" family: figures with
limbs, a truck). Where the families disagree, the outline is uncertain, and that is where to touch next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull
from scipy.special import ndtr

from glotouch_bt.robot import Array, ParamError
from glotouch_bt.touch.deviation import Hypothesis, explain
from glotouch_bt.touch.polygons import (
    area_and_centroid,
    convex_hull,
    minimum_rectangle,
    polygon_distance,
    shrunk_convex,
)
from glotouch_bt.touch.primitives import (
    APPROACH_SD_RAD,
    CONTACT_SD_M,
    NORMAL_SD_RAD,
    Touches,
    circle,
    fit,
    rounded,
    wrapped,
)
from glotouch_bt.touch.values import Contour, ContourFamily, ContourKind

AMPLITUDES: tuple[float, ...] = (0.3, 1.0, 2.0)
"""Deviations a circle is given (a rectangle: the first); scales of the spread over random objects."""
LOOSENESS = ((1.0, 0.3), (2.2, 0.03))
"""A plain circle or rectangle leaves the contacts' scatter, or so many times as much; each with its prior."""
MODES, MODE_LOSS = 3, 12.0
"""So many optima of the rectangle are kept, if their loss is within so much of the best one's."""
ROUND_CORNER_M = 0.006
"""A rectangle with rounder corners is a free outline: sharp ones would stick out by 0.41 of their radius."""
BOX_RATIO, BOX_FILL, SLENDER_RATIO, WIDEST_M = 1.25, 0.8, 1.6, 0.080
"""When a free outline is squeezed like a box, in three parallel tracks across its long side, instead of from three
directions like something round: if it is BOX_RATIO longer than wide and its hull fills BOX_FILL of its rectangle (a
figure fills less, an ellipse 0.79), or if it is slender, or too long for jaws that open 85 mm to close across."""
BEARINGS = 72
"""Rays an outline is drawn with: 5 degrees apart, 3 mm on an object 60 mm wide."""
FREE_BINS = 18
"""Of free places, the nearest to the middle in each of so many sectors forbids the others too."""
TEMPER = 0.5
"""Power of the evidence: every hypothesis takes its misfit for independent from contact to contact, which it is not."""
DULL_WEIGHT = 1e-3
"""Hypotheses of less weight are dropped."""


def believe_outline(
    tip_K_m: Array,
    tip_radius_m: float,
    *,
    approach_K: Array | None = None,
    reaction_K: Array | None = None,
    pushed_K_m: Array | None = None,
    free_K_m: Array | None = None,
    contact_sd_m: float = CONTACT_SD_M,
    strays: int = 0,
) -> OutlineBelief:
    """The belief after k >= 1 contacts with one object.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the onsets, in order of time.
        tip_radius_m: Radius of the ball.
        approach_K: (k, 2) or (k, 3) directions the ball moved in.
        reaction_K: (k, 2) or (k, 3) directions of the force it felt; rows of zeros or NaN are not known.
        pushed_K_m: (k, 2) how far each contact shoved the object; all contacts are moved to where it stands now.
        free_K_m: (m, 2) places the ball's centre has been without touching the object as it stands now.
        contact_sd_m: Scatter of a ball's centre at the onset.
        strays: So many of the first contacts were made before the object moved, by a common, unknown shift.

    Raises:
        ParamError: No contact, none since the object moved, wrong shapes, or values that are not finite.
    """
    tips = np.asarray(tip_K_m, dtype=np.float64)
    if tips.ndim != 2 or len(tips) < 1 or tips.shape[1] not in (2, 3):
        raise ParamError("tip_K_m", tips.shape, "(k, 2) or (k, 3) with k >= 1 contacts")
    tips = tips[:, :2]
    if not 0 <= strays < len(tips):
        raise ParamError("strays", strays, f"0 to {len(tips) - 1}")
    if not np.isfinite(tips).all():
        raise ParamError("tip_K_m", "NaN or infinity inside", "finite")
    approach = _directions("approach_K", approach_K, len(tips))
    reaction = _directions("reaction_K", reaction_K, len(tips))
    if pushed_K_m is not None:
        tips = present_tips(tips, pushed_K_m)
    felt = np.any(reaction != 0.0, axis=1)
    seen = np.any(approach != 0.0, axis=1)
    normal = np.where(felt[:, None], reaction, -approach)
    sd = np.where(felt, NORMAL_SD_RAD, np.where(seen, APPROACH_SD_RAD, np.inf))
    bearing = np.arctan2(normal[:, 1], normal[:, 0])
    touches = Touches(tips, bearing, sd, approach, np.zeros((0, 2)), tip_radius_m, contact_sd_m, strays)
    if free_K_m is not None and len(free_K_m) > 0:
        free = _nearest_free(np.asarray(free_K_m, dtype=np.float64)[:, :2], touches)
        touches = Touches(tips, bearing, sd, approach, free, tip_radius_m, contact_sd_m, strays)
    return OutlineBelief(*_hypotheses(touches), touches)


def present_tips(tip_K_m: Array, pushed_K_m: Array) -> Array:
    """(k, 2) ball centres moved along with an object that was shoved by `pushed_K_m` (k, 2) after each contact.

    Raises:
        ParamError: Not one push a contact, or one that is not finite.
    """
    pushed = np.asarray(pushed_K_m, dtype=np.float64)
    if pushed.shape != (len(tip_K_m), 2) or not np.isfinite(pushed).all():
        raise ParamError("pushed_K_m", pushed.shape, f"finite, ({len(tip_K_m)}, 2)")
    return np.asarray(np.asarray(tip_K_m, dtype=np.float64)[:, :2] + np.cumsum(pushed[::-1], axis=0)[::-1])


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

        The ball's centre, coming straight towards `centre_K_m`, is expected there at the contact.
        """
        mean, sd, weights = self._components(self.centre_K_m, bearing_rad)
        middle = weights @ mean
        return middle, np.asarray(np.sqrt(weights @ (sd**2 + (mean - middle) ** 2)))

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
        below = float(weights @ ndtr((float(np.linalg.norm(off)) - mean[:, 0]) / spread))
        return 2.0 * min(below, 1.0 - below)

    def _components(self, origin: Array, bearing: Array) -> tuple[Array, Array, Array]:
        """Each hypothesis' mean and sd (h, n), and the weights (h,)."""
        means, sds = [], []
        for h in self.hypotheses:
            mean, rows = h.polar(origin, np.asarray(bearing, dtype=np.float64))
            means.append(mean)
            sds.append(h.sd(rows))
        return np.array(means), np.array(sds), self.weights

    @cached_property
    def _middles(self) -> tuple[Array, Array]:
        """Each hypothesis' middle (h, 2) and its covariance (h, 2, 2)."""
        means, covariances = [], []
        for h in self.hypotheses:
            if h.amplitude == 0:
                means.append(h.corrected[:2])
                covariances.append(h.covariance[:2, :2])
                continue
            origin, u = h.corrected[:2], _unit(_grid())
            distance, rows = h.polar(origin, _grid())
            means.append(self._middle_of(origin + distance[:, None] * u))
            by = _centroid_by_distance(distance, u) @ rows
            covariances.append(by @ h.covariance @ by.T)
        return np.array(means), np.array(covariances)

    def _middle_of(self, offset_outline: Array) -> Array:
        return area_and_centroid(shrunk_convex(convex_hull(offset_outline), self.touches.radius_m))[1]

    def _free_contour(self) -> Contour:
        """The free hypotheses' mean outline; see `Contour`."""
        free = np.array([_family(h) == "free" for h in self.hypotheses])
        weights = self.weights * free / float(self.weights @ free)
        origin = weights @ self._middles[0]
        bearing = _grid()
        outlines = np.array([h.polar(origin, bearing)[0] for h in self.hypotheses])
        distance = weights @ outlines
        offset = origin + distance[:, None] * _unit(bearing)
        hull = shrunk_convex(convex_hull(offset), self.touches.radius_m)
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
        mean, rows = h.polar(self.centre_K_m, bearing)
        root = np.linalg.cholesky(h.covariance + 1e-14 * np.eye(len(h.covariance)))
        draws = np.random.default_rng(0).normal(size=(n, len(root)))
        distance = np.maximum(mean + draws @ (rows @ root).T, 1e-3)
        return np.asarray(self.centre_K_m + distance[:, :, None] * _unit(bearing))


def _boxlike(size: tuple[float, float], area: float) -> bool:
    ratio = size[0] / size[1]
    filled = ratio > BOX_RATIO and area > BOX_FILL * size[0] * size[1]
    return filled or ratio > SLENDER_RATIO or (size[0] > WIDEST_M and ratio > 1.1)


def _family(h: Hypothesis) -> ContourFamily:
    if h.shape is circle:
        return "circle" if h.amplitude == 0 else "free"
    return "rectangle" if h.amplitude == 0 and h.corrected[5] < ROUND_CORNER_M else "free"


def _hypotheses(touches: Touches) -> tuple[tuple[Hypothesis, ...], Array]:
    """Explanations, weightiest first, and their weights."""
    found: list[Hypothesis] = []
    prior: list[float] = []
    rounds, _ = fit(circle, touches.rooted)
    boxes, losses = fit(rounded, touches.rooted)
    for looseness, chance in LOOSENESS:
        found.append(explain(circle, rounds[0], 0.0, touches, looseness))
        prior.append(chance)
    middle = explain(circle, rounds[0], AMPLITUDES[1], touches).corrected
    for amplitude in AMPLITUDES:
        found.append(explain(circle, middle, amplitude, touches))
        prior.append(1 / 15)
    for i, params in enumerate(_distinct(boxes[losses < losses[0] + MODE_LOSS])):
        for looseness, chance in LOOSENESS if i == 0 else LOOSENESS[:1]:
            found.append(explain(rounded, params, 0.0, touches, looseness))
            prior.append(chance)
        for amplitude in AMPLITUDES[:2] if i == 0 else ():
            found.append(explain(rounded, params, amplitude, touches))
            prior.append(1 / 15)
    score = TEMPER * np.array([h.log_evidence for h in found]) + np.log(prior)
    weights = np.exp(score - score.max())
    weights /= weights.sum()
    order = [int(i) for i in np.argsort(-weights, kind="stable") if weights[i] > DULL_WEIGHT]
    kept = weights[order]
    return tuple(found[i] for i in order), kept / kept.sum()


def _distinct(boxes: Array) -> list[Array]:
    """The first of boxes (s, 6) that are not each other's likes (a quarter turn with the sides swapped is the same)."""
    kept: list[Array] = []
    for p in boxes:
        turns = round(float(p[2]) / (0.5 * math.pi))
        a, b = (p[3], p[4]) if turns % 2 == 0 else (p[4], p[3])
        like = np.array([p[0], p[1], (p[2] - turns * 0.5 * math.pi) * 0.03, a, b, p[5]])
        same = np.array([p[0], p[1], -like[2] if abs(like[2]) > 0.02 else like[2], b, a, p[5]])
        if all(min(np.abs(like - q).max(), np.abs(same - q).max()) > 0.002 for q in kept):
            kept.append(like)
        if len(kept) == MODES:
            break
    return [np.array([q[0], q[1], q[2] / 0.03, q[3], q[4], q[5]]) for q in kept]


def _nearest_free(free: Array, touches: Touches) -> Array:
    """Of free places (m, 2), the nearest to the contacts' likely middle in each sector, none beside a contact."""
    middle = touches.likely_middle_m
    if len(touches.tips_m) > 2:
        middle = 0.5 * (touches.tips_m.min(axis=0) + touches.tips_m.max(axis=0))
    gap = np.min(np.linalg.norm(free[:, None] - touches.tips_m, axis=2), axis=1)
    off = free[gap > 0.5 * touches.radius_m] - middle
    distance = np.linalg.norm(off, axis=1)
    off, distance = off[distance < LARGEST_FREE_M], distance[distance < LARGEST_FREE_M]
    sector = np.floor((np.arctan2(off[:, 1], off[:, 0]) / (2 * math.pi) + 0.5) * FREE_BINS).astype(int)
    order = np.argsort(distance, kind="stable")
    _, first = np.unique(sector[order], return_index=True)
    return np.asarray(middle + off[order[first]])


LARGEST_FREE_M = 0.08
"""Free places further from the middle say nothing."""


def _directions(name: str, given: Array | None, k: int) -> Array:
    """(k, 2) unit vectors; zeros where nothing is known."""
    if given is None:
        return np.zeros((k, 2))
    d = np.nan_to_num(np.asarray(given, dtype=np.float64))
    if d.ndim != 2 or len(d) != k or d.shape[1] not in (2, 3):
        raise ParamError(name, d.shape, f"one direction a contact, ({k}, 2) or ({k}, 3)")
    norm = np.linalg.norm(d[:, :2], axis=1, keepdims=True)
    return np.where(norm > 1e-6, d[:, :2] / np.maximum(norm, 1e-6), 0.0)


def _shrunk(offset_outline: Array, r: float) -> Array:
    """The outline (m, 2) whose offset by r is given: its parallel curve, without the loops that run too near."""
    tangent = np.roll(offset_outline, -1, axis=0) - np.roll(offset_outline, 1, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    inner = offset_outline - r * np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    depth = -polygon_distance(offset_outline, inner)
    return np.asarray(inner[depth > 0.93 * r])


def _centroid_by_distance(distance: Array, u: Array) -> Array:
    """(2, n) derivative of the hull's area centroid by the distances (n,) of an outline along unit vectors u (n, 2).

    Of A = sum v x v' / 2 and M = sum (v x v') (v + v') / 6 over the hull's corners v and the following ones v'.
    """
    by = np.zeros((2, len(distance)))
    points = distance[:, None] * u
    corners = ConvexHull(points).vertices
    v, e = points[corners], u[corners]
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
