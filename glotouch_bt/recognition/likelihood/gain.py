"""Expected information gain of closures, from a few weighted poses of the target and a few other objects.

A closure on candidate c multiplies the odds of c by one ratio r. Under "c is the target" its observation is what the
STL shows at the true pose, one of the posterior's; under any other hypothesis it is what some object shows. Both are
summed over as few points, and the entropy of {candidates, none} before and after compared.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from glotouch_bt.recognition.decision import Closure
from glotouch_bt.recognition.likelihood.background import WIDTH_SCALE_M, generic_features, log_kernel
from glotouch_bt.recognition.likelihood.pair import Pair, Reading
from glotouch_bt.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.recognition.likelihood.scalars import yaw_prior
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.recognition.pads import Array32
from glotouch_bt.recognition.raster import hand_axes
from glotouch_bt.robot import Array
from glotouch_bt.touch.values import Candidate

POSES, OTHERS, SURFACES = 10, 16, 96
"""Poses of the target, other objects, and background surfaces the sums run over."""
FIRST_SCALE_M = 4e-3
NEAR_M, NEAR_RAD = 0.008, math.radians(20.0)
"""A closure this near to one already made (height and track; yaw) repeats it."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where the target would lie if it were this candidate.

    Attributes:
        candidate: The candidate.
        yaw_index, z0_m, weight: (s,) its likeliest poses: relative yaw of a hand at `first_rad`, in table steps.
        first_rad: That hand's yaw.
        felt: (n, 4) closures made: x_K, y_K, height, yaw; widths_m (n,) what they measured.
    """

    candidate: Candidate
    yaw_index: Array
    z0_m: Array
    weight: Array
    first_rad: float
    felt: Array
    widths_m: Array


def predict(model: TargetModel, reading: Reading, pair: Pair, p: LikelihoodParams) -> Prediction:
    """The likeliest poses of a candidate, by weight."""
    candidate = reading.touchset.candidate
    z0 = np.linspace(-p.z0_limit_m, p.z0_limit_m, p.z0_steps) if p.z0_steps > 1 else np.zeros(1)
    if pair.log_pose is None:
        log_pose = yaw_prior(model, candidate, pair.first_rad, p)[:, None]
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
        candidate, best // log_pose.shape[1], z0[best % log_pose.shape[1]], weight / weight.sum(), pair.first_rad,
        felt, np.array([e.width_m for e in layers]),
    )  # fmt: skip


def expected_gains(
    model: TargetModel,
    predictions: Mapping[int, Prediction],
    shares: Mapping[int, float],
    p_absent: float,
    closures: Sequence[Closure],
    p: LikelihoodParams,
) -> Array:
    """(n,) nats, not negative. Shares and `p_absent` sum to 1."""
    if not closures:
        return np.zeros(0)
    rest = np.array([*shares.values(), p_absent])
    entropy = float(-(rest * np.log(np.maximum(rest, 1e-300))).sum())
    library = generic_features(model.pad)
    library = library[:: max(1, len(library) // SURFACES)]
    others = library[:: max(1, len(library) // OTHERS)][:OTHERS]
    quantile = np.tan(np.pi * (((np.arange(len(others)) * 7 % len(others)) + 0.5) / len(others) - 0.5))  # of a Cauchy
    spread = 1 - p.image_outlier
    log_other = np.log(np.exp(log_kernel(_squared(others, library), p)).mean(axis=-1))
    out = []
    for c in closures:
        q = predictions[c.candidate]
        width, left, right, novelty = _at(model, q, c)
        guess, scale = _guess(q, c)
        felt = np.isfinite(width)
        w = np.where(felt, width, 1.0)
        # Ratios where the target is there (one a pose) and where some other object is (one a surface and quantile).
        seen = np.concatenate([w, guess + scale * quantile])
        generic = scale / math.pi / (scale**2 + (seen - guess) ** 2)
        sd = math.hypot(p.width_sd_m, p.bias_sd_m)
        near = np.exp(-0.5 * ((seen[:, None] - w[None]) / sd) ** 2) * felt / (sd * math.sqrt(2 * math.pi))
        ratio = p.temper_width * np.log((1 - p.width_outlier) * (near @ q.weight) / generic + p.width_outlier)
        images = np.zeros(len(seen))
        for side in (left, right):
            own = np.exp(log_kernel(_squared(side, side), p)) @ q.weight
            own_ratio = own / np.exp(log_kernel(_squared(side, library), p)).mean(axis=-1)
            other_ratio = (np.exp(log_kernel(_squared(others, side), p)) @ q.weight) / np.exp(log_other)
            images += p.temper_image * np.log(spread * np.concatenate([own_ratio, other_ratio]) + p.image_outlier)
        log_ratio = p.slope * novelty * (ratio + images)
        out.append(_gain(log_ratio[: len(w)], q.weight, log_ratio[len(w) :], shares[c.candidate], entropy))
    return np.array(out)


def _gain(there: Array, weight: Array, not_there: Array, share: float, entropy: float) -> float:
    """Entropy before minus its mean after one observation that concerns one candidate's odds only."""
    if share <= 0 or share >= 1:
        return 0.0
    own = -(share * math.log(share) + (1 - share) * math.log(1 - share))
    among = (entropy - own) / (1 - share)  # entropy of the others, given that it is not this one

    def after(log_ratio: Array) -> Array:
        x = np.clip(log_ratio + math.log(share / (1 - share)), -60, 60)
        s = 1 / (1 + np.exp(-x))
        h = -(s * np.log(np.maximum(s, 1e-300)) + (1 - s) * np.log(np.maximum(1 - s, 1e-300)))
        return np.asarray(h + (1 - s) * among)

    mean = share * float(weight @ after(there)) + (1 - share) * float(after(not_there).mean())
    return max(0.0, entropy - mean)


def _at(model: TargetModel, q: Prediction, c: Closure) -> tuple[Array, Array32, Array32, float]:
    """Predicted widths (s,), left and right features (s, 35), and how new the closure is (0..1)."""
    n = len(model.phi_rad)
    turn = (c.yaw_K_rad - q.first_rad) / (2 * np.pi) * n
    i = np.rint(q.yaw_index + turn).astype(np.int64) % n
    x, _ = hand_axes(model.phi_rad[i])
    centre = model.outline.of(q.candidate.contour.kind).centre_m
    x_K, _ = hand_axes(np.asarray(c.yaw_K_rad))
    along = float(x_K @ (np.asarray(c.position_K_m) - q.candidate.contour.centre_K_m)) + x @ centre
    j = _nearest(model.l_m, along)
    k = _nearest(model.z_m, c.height_m + q.z0_m)
    right = model.images[(i + n // 2) % n, _nearest(model.l_m, -along), k]
    right = right.reshape(-1, 7, 5)[:, :, ::-1].reshape(len(i), -1)
    novelty = 1.0
    if len(q.felt):
        d2 = ((q.felt[:, :2] - c.position_K_m) ** 2).sum(axis=1) + (q.felt[:, 2] - c.height_m) ** 2
        turned = (q.felt[:, 3] - c.yaw_K_rad + np.pi / 2) % np.pi - np.pi / 2
        novelty = 1 - float(np.exp(-0.5 * d2 / NEAR_M**2 - 0.5 * (turned / NEAR_RAD) ** 2).max())
    return model.width_m[i, j, k].astype(np.float64), model.images[i, j, k], right, novelty


def _guess(q: Prediction, c: Closure) -> tuple[float, float]:
    """Where the background expects the width, and how surely: the nearest closure made, or the outline's span."""
    if len(q.felt):
        turned = np.abs((q.felt[:, 3] - c.yaw_K_rad + np.pi / 2) % np.pi - np.pi / 2)
        at = int(np.argmin(np.abs(q.felt[:, 2] - c.height_m) + 0.03 * turned))
        if turned[at] < math.radians(75.0):
            return float(q.widths_m[at]), WIDTH_SCALE_M
    low, high = q.candidate.span_m(c.yaw_K_rad + 0.5 * math.pi)
    return high - low, FIRST_SCALE_M


def _squared(a: Array32, b: Array32) -> Array32:
    """(len(a), len(b)) mean squared distance of features."""
    d = (a**2).sum(axis=1)[:, None] - 2 * a @ b.T + (b**2).sum(axis=1)[None]
    return np.asarray(np.maximum(d, 0) / a.shape[1])


def _nearest(axis: Array, x: Array) -> Array:
    return np.asarray(np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0])), 0, len(axis) - 1), dtype=np.int64)
