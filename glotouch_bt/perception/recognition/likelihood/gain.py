"""Expected information gain of closures, summed over a few poses of the target and a few other objects.

A closure on candidate c multiplies the odds of c by a likelihood ratio r. If c is the target, the observation follows
from the STL at a pose of the posterior; otherwise from another object. The gain is the expected decrease of the entropy
of {candidates, none}.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.recognition.decision import Closure
from glotouch_bt.perception.recognition.likelihood.background import (
    FIRST_SCALE_M,
    WIDTH_SCALE_M,
    generic_features,
    image_kernel,
    mean_squared,
)
from glotouch_bt.perception.recognition.likelihood.pair import Pair, TouchSetReading
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.scalars import yaw_prior
from glotouch_bt.perception.recognition.likelihood.volumes import T_PEAK, width_kernel
from glotouch_bt.perception.recognition.model import POOLED, Array32, PadSpec, TargetModel, hand_axes, span
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.perception.touch.calibration import MEASURED_SD_M
from glotouch_bt.robot import Array

POSES = 10
"""Number of poses of the target."""
OTHERS = 16
"""Number of other objects."""
SURFACES = 96
"""Number of background surfaces."""
UNEVEN_M = 4e-4
"""Typical difference of neighbouring cells of the width table."""
NEAR_M = 0.008
"""Position scale within which a closure repeats an earlier one."""
NEAR_RAD = math.radians(20.0)
"""Yaw scale within which a closure repeats an earlier one."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """The target's most probable poses, given that it is this candidate.

    Attributes:
        candidate: The candidate.
        model: The target, as it most probably stands.
        yaw_index, z0_m, weight: (s,) poses: relative yaw at `first_rad` in table steps, height offset, weight.
        first_rad: Yaw of that hand.
        felt: (n, 4) closures so far: x_K, y_K, height, yaw.
        widths_m: (n,) their widths.
    """

    candidate: Candidate
    model: TargetModel
    yaw_index: Array
    z0_m: Array
    weight: Array
    first_rad: float
    felt: Array
    widths_m: Array


def predict(reading: TouchSetReading, pair: Pair, p: LikelihoodParams) -> Prediction:
    """Return the most probable poses of a candidate."""
    candidate, model = reading.touchset.candidate, pair.hypothesis.model
    z0 = span(p.z0_limit_m, p.z0_steps)
    if pair.log_pose is None:
        log_pose = yaw_prior(model, candidate, pair.section, pair.first_rad, p)[:, None]
        z0 = np.zeros(1)
    else:
        log_pose = pair.log_pose.astype(np.float64)
    flat = log_pose.reshape(-1)
    order = np.argsort(-flat, kind="stable")
    if pair.log_pose is None and np.ptp(flat) < 1e-6:
        order = order[:: max(1, len(order) // POSES)]
    best = order[:POSES]
    weight = np.exp(flat[best] - flat[best].max())
    layers = [o.layer for s in reading.sequences for o in s]
    places = [reading.touchset.sequences[e.sequence].layers[e.index] for e in layers]
    felt = np.array([[*q.position_K_m, q.height_m, q.yaw_rad] for q in places]).reshape(-1, 4)
    return Prediction(
        candidate, model, best // log_pose.shape[1], z0[best % log_pose.shape[1]], weight / weight.sum(),
        pair.first_rad, felt, np.array([e.width_m for e in layers]),
    )  # fmt: skip


def expected_gains(
    pad: PadSpec,
    predictions: Mapping[int, Prediction],
    shares: Mapping[int, float],
    p_absent: float,
    closures: Sequence[Closure],
    p: LikelihoodParams,
) -> Array:
    """Return the gains (n,), nats, not negative. Shares and `p_absent` sum to 1."""
    if not closures:
        return np.zeros(0)
    rest = np.array([*shares.values(), p_absent])
    entropy = float(-(rest * np.log(np.maximum(rest, 1e-300))).sum())
    library = generic_features(pad)
    library = library[:: max(1, len(library) // SURFACES)]
    others = library[:: max(1, len(library) // OTHERS)][:OTHERS]
    generic_other = image_kernel(mean_squared(others, library), p).mean(axis=-1)
    n_other = len(others)
    quantile = np.tan(np.pi * (((np.arange(n_other) * 7 % n_other) + 0.5) / n_other - 0.5))  # of a Cauchy
    out = np.zeros(len(closures))
    for candidate in sorted({c.candidate for c in closures}):
        q = predictions[candidate]
        where = [i for i, c in enumerate(closures) if c.candidate == candidate]
        mine = [closures[i] for i in where]
        width, sides, novelty, known = _at(q, mine)
        # Ratios for the target (one per pose), then for other objects (one per surface and quantile).
        ratio = _width_ratios(width, np.array([_guess(q, c) for c in mine]), quantile, q.weight, known, p)
        for side, alike in zip(sides, known.images, strict=True):
            ratio += _image_ratios(side, library, others, generic_other, q.weight, alike, p)
        ratio *= p.slope * novelty[:, None]
        s = width.shape[1]
        out[where] = entropy_decrease(ratio[:, :s], q.weight, ratio[:, s:], shares[candidate], entropy)
    return out


@dataclass(frozen=True)
class _Known:
    """Certainty of the predictions, each (n, s): standard deviation of a width, shares known (see `Certainty`)."""

    width_sd_m: Array
    width: Array
    images: tuple[Array, Array]


def _width_ratios(
    width: Array, guess: Array, quantile: Array, weight: Array, known: _Known, p: LikelihoodParams
) -> Array:
    """Return tempered log ratios (n, s + o) of widths: of the target's poses, then of other objects."""
    middle, scale = guess[:, :1], guess[:, 1:]
    felt = np.isfinite(width)
    w = np.where(felt, width, 1.0)
    seen = np.concatenate([w, middle + scale * quantile], axis=1)
    generic = scale / math.pi / (scale**2 + (seen - middle) ** 2)
    sd = np.hypot(math.hypot(p.width_sd_m, MEASURED_SD_M, p.width_rough * UNEVEN_M), known.width_sd_m)[:, None]
    near = width_kernel((seen[:, :, None] - w[:, None, :]) / sd) * (felt * known.width)[:, None, :] / sd
    target = (near @ weight) * T_PEAK
    unknown = (1 - known.width @ weight)[:, None]
    log_ratio = np.log((1 - p.width_outlier) * (target / generic + unknown) + p.width_outlier)
    return np.asarray(p.temper_width * log_ratio, dtype=np.float64)


def _image_ratios(
    side: Array32,
    library: Array32,
    others: Array32,
    generic_other: Array32,
    weight: Array,
    known: Array,
    p: LikelihoodParams,
) -> Array:
    """Return tempered log ratios (n, s + o) of one pad's images: of the target's poses, then of other objects."""
    n, s, size = side.shape
    flat = side.reshape(-1, size)
    norm = (side**2).sum(axis=2)
    inner = np.maximum(norm[:, :, None] + norm[:, None, :] - 2 * side @ side.transpose(0, 2, 1), 0) / np.float32(size)
    shares = known * weight
    unknown = (1 - shares.sum(axis=1))[:, None]
    own = np.einsum("nij,nj->ni", image_kernel(inner, p), shares) / image_kernel(mean_squared(flat, library), p).mean(
        axis=-1
    ).reshape(n, s)
    other = (image_kernel(mean_squared(others, flat), p).reshape(len(others), n, s) * shares).sum(
        axis=2
    ).T / generic_other
    ratio = np.concatenate([own, other], axis=1) + unknown
    return np.asarray(p.temper_image * np.log((1 - p.image_outlier) * ratio + p.image_outlier), dtype=np.float64)


def entropy_decrease(there: Array, weight: Array, not_there: Array, share: float, entropy: float) -> Array:
    """Return entropy minus its expectation (n,), nats, after an observation that changes one candidate's odds.

    Args:
        there: (n, s) changes of its log odds, nats, if it is the target.
        weight: (s,) their weights, summing to 1.
        not_there: (n, o) changes of its log odds if it is not, equally likely.
        share: Its probability.
        entropy: Entropy of {candidates, none} before, nats.
    """
    if share <= 0 or share >= 1:
        return np.zeros(len(there))
    own = -(share * math.log(share) + (1 - share) * math.log1p(-share))
    among = (entropy - own) / (1 - share)  # entropy of the others, given that this one is not the target
    odds = math.log(share) - math.log1p(-share)

    def after(log_ratio: Array) -> Array:
        s = 1 / (1 + np.exp(-np.clip(log_ratio + odds, -60, 60)))
        h = -(s * np.log(np.maximum(s, 1e-300)) + (1 - s) * np.log(np.maximum(1 - s, 1e-300)))
        return np.asarray(h + (1 - s) * among)

    mean = share * (after(there) @ weight) + (1 - share) * after(not_there).mean(axis=1)
    return np.asarray(np.maximum(entropy - mean, 0.0))


def _at(q: Prediction, closures: Sequence[Closure]) -> tuple[Array, tuple[Array32, Array32], Array, _Known]:
    """Return predicted widths (n, s), (left, right) features (n, s, 35), novelty of each closure (n,), 0..1, and
    certainty."""
    model, n = q.model, len(q.model.phi_rad)
    yaw = np.array([c.yaw_K_rad for c in closures])
    height = np.array([c.height_m for c in closures])
    place = np.array([c.position_K_m for c in closures], dtype=np.float64).reshape(-1, 2)
    turn = (yaw - q.first_rad) / (2 * np.pi) * n
    i = np.rint(q.yaw_index[None, :] + turn[:, None]).astype(np.int64) % n
    x, _ = hand_axes(model.phi_rad[i])
    centre = model.outline.of(q.candidate.contour.kind).centre_m
    x_K, _ = hand_axes(yaw)
    along = ((place - q.candidate.contour.centre_K_m) * x_K).sum(axis=1)[:, None] + x @ centre
    j = _nearest(model.l_m, along)
    k = _nearest(model.z_m, height[:, None] + q.z0_m[None, :])
    left = model.images[i, j, k]
    j_right, i_right = _nearest(model.l_m, -along), (i + n // 2) % n
    right = model.images[i_right, j_right, k]
    right = np.ascontiguousarray(right.reshape(*i.shape, *POOLED)[..., ::-1]).reshape(left.shape)
    novelty = np.ones(len(closures))
    if len(q.felt):
        d2 = ((q.felt[None, :, :2] - place[:, None]) ** 2).sum(axis=2) + (q.felt[None, :, 2] - height[:, None]) ** 2
        turned = (q.felt[None, :, 3] - yaw[:, None] + np.pi / 2) % np.pi - np.pi / 2
        novelty -= np.exp(-0.5 * d2 / NEAR_M**2 - 0.5 * (turned / NEAR_RAD) ** 2).max(axis=1)
    sure = np.ones(i.shape)
    known = _Known(np.zeros(i.shape), sure, (sure, sure))
    if (c := model.certainty) is not None:
        images = c.image_known[i, j, k], c.image_known[i_right, j_right, k]
        known = _Known(c.width_sd_m[i, j, k], c.width_known[i, j, k], images)
    return model.width_m[i, j, k].astype(np.float64), (left, right), novelty, known


def _guess(q: Prediction, c: Closure) -> tuple[float, float]:
    """Return the background's predicted width and its scale: from the nearest closure, or the outline's span."""
    if len(q.felt):
        turned = np.abs((q.felt[:, 3] - c.yaw_K_rad + np.pi / 2) % np.pi - np.pi / 2)
        at = int(np.argmin(np.abs(q.felt[:, 2] - c.height_m) + 0.03 * turned))
        if turned[at] < math.radians(75.0):
            return float(q.widths_m[at]), WIDTH_SCALE_M
    low, high = q.candidate.span_m(c.yaw_K_rad + 0.5 * math.pi)
    return high - low, FIRST_SCALE_M


def _nearest(axis: Array, x: Array) -> Array:
    return np.asarray(np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0])), 0, len(axis) - 1), dtype=np.int64)
