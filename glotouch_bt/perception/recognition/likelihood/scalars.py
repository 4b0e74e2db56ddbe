"""Log ratios target : background of contour kind, contour size and height, and pose priors."""

from __future__ import annotations

import math

import numpy as np
import scipy

from glotouch_bt.perception.recognition.likelihood.contacts import SectionFit
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.model import SENSING_M, TargetModel, hand_axes, size_variance_m2
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Array

SIZES_M = (0.020, 0.110)
"""Range of the uniform background density of a side (objects of 4-11 cm)."""
HEIGHTS_M = (0.018, 0.115)
"""Range of the uniform background density of a height."""
FREE_KIND_WEIGHT = 0.4
"""Weight of the kind (round or box) of an irregular outline, 0..1. Source: 7 of 13 targets with irregular outlines had
a negative term `mode` in `bench retrieve --objects DIR --trials 4 --per-seed 2 --seed 38000 --conditions realistic`
(c4bb0c7; folders of `tests/support/any_shape.py`, seeds 8001-8003)."""
RISE_SHARE = 0.75
"""Distance of the measured top from the edge on which a leaning object stands, over its side. Source: half a side for a
top in the middle, a whole side for the far edge of a flat top."""
TAIL = 3.0
"""Degrees of freedom of the Student's t of a contour's side."""


def mode_ratio(model: TargetModel, candidate: Candidate) -> float:
    """Return log P(kind | traces of the STL) - log 1/2, less of it for an irregular outline."""
    box = model.outline.p_box
    if candidate.contour.family == "free":  # neither circle nor rectangle: the kind is a weak cue
        box = 0.5 + FREE_KIND_WEIGHT * (box - 0.5)
    return math.log(2 * (box if candidate.contour.kind == "box" else 1 - box))


def height_ratio(model: TargetModel, candidate: Candidate, p: LikelihoodParams) -> float:
    """Return the log ratio of the measured top; 0 if not touched.

    If the contour is that of the whole object, the top is the model's, seldom a lower point. If it covers a part, the
    top is that of a part as well.
    """
    low, high = HEIGHTS_M
    if not candidate.top_touched:
        return 0.0
    span = max(model.height_m - SENSING_M, 5e-3)
    lower = 1 / span if SENSING_M <= candidate.height_m <= model.height_m else 0.0
    *parts, top = _height_density(candidate.height_m - model.tops_m, model, p).tolist()
    whole = whole_share(model, candidate, p)
    density = whole * ((1 - p.height_lower) * top + p.height_lower * lower) + (1 - whole) * 0.5 * (
        sum(parts) / len(parts) + lower
    )
    return math.log(0.99 * density * (high - low) + 0.01)


def _height_density(off_m: Array, model: TargetModel, p: LikelihoodParams) -> Array:
    """Return the densities (n,), 1/m, of measured less nominal heights (n,).

    The error is normal. An object that leans on an uneven base is higher: its top, up to a whole side away from the
    edge on which it stands, rises by an exponentially distributed amount. Their sum is an exponentially modified
    Gaussian (E. Grushka, 1972).
    """
    unsure_m = model.certainty.height_sd_m if model.certainty is not None else 0.0
    sd_m = math.hypot(p.height_sd_m, p.scale_sd * model.height_m, 2 * p.offset_sd_m, unsure_m)
    rise_m = p.lean_rad * RISE_SHARE * float(np.mean(model.outline.likely.size_m))
    log_density = 0.5 * (sd_m / rise_m) ** 2 - off_m / rise_m + scipy.special.log_ndtr(off_m / sd_m - sd_m / rise_m)
    return np.asarray(np.exp(log_density) / rise_m)


def whole_share(model: TargetModel, candidate: Candidate, p: LikelihoodParams) -> float:
    """Return the probability that the contour covers the whole object, 0..1, if it is the target."""
    return 1.0 - p.contour_outlier / math.exp(contour_ratio(model, candidate, p))


def contour_ratio(model: TargetModel, candidate: Candidate, p: LikelihoodParams) -> float:
    """Return the log ratio of the contour's sides, compared with the model's traces of the same kind."""
    contour = candidate.contour
    traced = model.outline.of(contour.kind)
    one = contour.family == "circle"
    low, high = SIZES_M
    good = other = 1.0
    for i in range(1 if one else 2):
        coarse = size_variance_m2(contour, i)
        if len(contour.residuals_m) >= traced.contacts:  # the traces show how far a fit of so many contacts errs
            coarse = max(coarse - traced.fit_sd_m[i] ** 2, 0.0)
        sd = math.sqrt(p.contour_sd_m**2 + traced.size_sd_m[i] ** 2 + coarse)
        good *= _student((contour.size_m[i] - traced.size_m[i]) / sd) / sd
        other /= high - low
    return math.log((1 - p.contour_outlier) * good / other + p.contour_outlier)


def shift_prior(
    model: TargetModel, candidate: Candidate, fit: SectionFit | None, yaw_rad: float, phi_rad: Array, shift_m: Array,
    p: LikelihoodParams,
) -> Array:  # fmt: skip
    """Return the log prior (72, nd) of the shift: contacts and section agree, or else the contours' centres.

    Args:
        model, candidate: The target, and what may be it.
        fit: The candidate's contacts in the target's section, if they are compared with it.
        yaw_rad: Yaw of the hand in K.
        phi_rad: (72,) yaws of the hand relative to the target.
        shift_m: (nd,) shifts.
        p: Parameters.
    """
    if fit is not None:
        x, _ = hand_axes(np.asarray(yaw_rad))
        expected = (np.asarray(candidate.contour.centre_K_m) - fit.middle_K_m(yaw_rad - phi_rad, p)) @ x
        variance = p.slide_sd_m**2
    else:
        traced = model.outline.of(candidate.contour.kind)
        expected = hand_axes(phi_rad)[0] @ traced.centre_m
        variance = p.shift_sd_m**2 + traced.centre_sd_m**2
    off = shift_m[None, :] - expected[:, None]
    weight = np.exp(-0.5 * off**2 / variance) + 1e-9
    weight /= weight.sum(axis=1, keepdims=True)
    return np.asarray(np.log(0.9 * weight + 0.1 / len(shift_m)))


def yaw_prior(
    model: TargetModel, candidate: Candidate, fit: SectionFit | None, first_rad: float, p: LikelihoodParams
) -> Array:
    """Return the log prior (72,) of the relative yaw of a hand at `first_rad`: that of the contacts in the section,
    or else a box is aligned with the model."""
    n = len(model.phi_rad)
    if fit is not None:
        return np.asarray(np.log(fit.yaw_weight(first_rad - model.phi_rad, p)))
    contour, o = candidate.contour, model.outline.as_box
    if contour.kind != "box":
        return np.full(n, -math.log(n))
    off = first_rad - model.phi_rad + o.yaw_rad - contour.yaw_rad
    off = (off + np.pi / 2) % np.pi - np.pi / 2
    slender = min(o.size_m[0] / o.size_m[1], contour.size_m[0] / max(contour.size_m[1], 1e-3)) - 1
    trust = 0.9 * float(np.clip(slender / 0.2, 0, 1))
    weight = np.exp(-0.5 * off**2 / (p.yaw_sd_rad**2 + o.yaw_sd_rad**2)) + 1e-9
    return np.asarray(np.log(trust * weight / weight.sum() + (1 - trust) / n))


def _student(z: float) -> float:
    """Return the density of Student's t with `TAIL` degrees of freedom."""
    c = math.gamma(0.5 * (TAIL + 1)) / (math.sqrt(TAIL * math.pi) * math.gamma(0.5 * TAIL))
    return float(c * (1 + z * z / TAIL) ** (-0.5 * (TAIL + 1)))
