"""Posterior over an object's outline given its contacts.

Hypotheses: circle, rectangle (every distinct optimum), and both with smooth deviations, weighted by evidence.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.touch.outline.deviation import Hypothesis
from glotouch_bt.perception.touch.outline.fitting import fit_both
from glotouch_bt.perception.touch.outline.mixture import TEMPER, OutlineBelief
from glotouch_bt.perception.touch.outline.polygons import nearest_distance
from glotouch_bt.perception.touch.outline.posteriors import infer_posteriors
from glotouch_bt.perception.touch.outline.primitives import (
    APPROACH_SD_RAD,
    CONTACT_SD_M,
    NORMAL_SD_RAD,
    Touches,
    circle,
    rounded,
)
from glotouch_bt.robot import Array, ParamError

AMPLITUDES: tuple[float, ...] = (0.3, 1.0, 2.0)
"""Deviation scales of a circle, relative to the spread over random objects; a rectangle uses the first two."""
SCATTER_SCALES = ((1.0, 0.3), (2.2, 0.03))
"""(factor on the contacts' scatter, prior probability) of plain primitives."""
DEVIATION_PRIOR = 1 / 15
"""Prior probability of each deviation amplitude."""
MAX_RECTANGLE_MODES = 3
"""Number of rectangle optima to keep."""
RECTANGLE_MODE_LOSS = 12.0
"""Keep an optimum only if its loss is within this of the best (nats)."""
FREE_SECTORS = 18
"""Number of sectors; only the innermost free position of each is used."""
SIDE_COSINE = 0.7
"""Minimum cosine between a contact's normal and a side's normal for the side to count as touched."""
MAX_OPEN_SIDE_M = 0.030
"""Maximum distance by which an untouched side may stand farther out."""
MIN_WEIGHT = 1e-3
"""Drop hypotheses of less weight."""
MAX_FREE_DISTANCE_M = 0.08
"""Ignore free positions farther than this from the middle."""


def infer_outline(
    tip_K_m: Array,
    tip_radius_m: float,
    *,
    approach_K: Array | None = None,
    reaction_K: Array | None = None,
    pushed_K_m: Array | None = None,
    free_K_m: Array | None = None,
    contact_sd_m: float = CONTACT_SD_M,
    outliers: int = 0,
) -> OutlineBelief:
    """Infer the outline of one object from k >= 1 contacts.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the onsets, in order of time.
        tip_radius_m: Radius of the ball.
        approach_K: (k, 2) or (k, 3) directions of motion.
        reaction_K: (k, 2) or (k, 3) directions of the force on the ball; rows of zeros or NaN are unknown.
        pushed_K_m: (k, 2) displacement of the object by each contact; contacts are moved to its current position.
        free_K_m: (m, 2) contact-free positions of the ball's centre, for the object's current position.
        contact_sd_m: Standard deviation of a ball centre at the onset.
        outliers: Number of first contacts made before the object moved by a common, unknown shift.

    Raises:
        ParamError: No contact, none since the object moved, wrong shapes, or values that are not finite.
    """
    tips = np.asarray(tip_K_m, dtype=np.float64)
    if tips.ndim != 2 or len(tips) < 1 or tips.shape[1] not in (2, 3):
        raise ParamError("tip_K_m", tips.shape, "(k, 2) or (k, 3) with k >= 1 contacts")
    tips = tips[:, :2]
    if not 0 <= outliers < len(tips):
        raise ParamError("outliers", outliers, f"0 to {len(tips) - 1}")
    if not np.isfinite(tips).all():
        raise ParamError("tip_K_m", "NaN or infinity inside", "finite")
    approach = _directions("approach_K", approach_K, len(tips))
    reaction = _directions("reaction_K", reaction_K, len(tips))
    if pushed_K_m is not None:
        tips = current_tips(tips, pushed_K_m)
    felt = np.any(reaction != 0.0, axis=1)
    seen = np.any(approach != 0.0, axis=1)
    normal = np.where(felt[:, None], reaction, -approach)
    sd = np.where(felt, NORMAL_SD_RAD, np.where(seen, APPROACH_SD_RAD, np.inf))
    bearing = np.arctan2(normal[:, 1], normal[:, 0])
    touches = Touches(tips, bearing, sd, approach, np.zeros((0, 2)), tip_radius_m, contact_sd_m, outliers)
    if free_K_m is not None and len(free_K_m) > 0:
        free = _nearest_free(np.asarray(free_K_m, dtype=np.float64)[:, :2], touches)
        touches = Touches(tips, bearing, sd, approach, free, tip_radius_m, contact_sd_m, outliers)
    return OutlineBelief(*_hypotheses(touches), touches)


def current_tips(tip_K_m: Array, pushed_K_m: Array) -> Array:
    """Return ball centres (k, 2) moved with an object that each contact displaced by `pushed_K_m` (k, 2).

    Raises:
        ParamError: Not one displacement per contact, or one that is not finite.
    """
    pushed = np.asarray(pushed_K_m, dtype=np.float64)
    if pushed.shape != (len(tip_K_m), 2) or not np.isfinite(pushed).all():
        raise ParamError("pushed_K_m", pushed.shape, f"finite, ({len(tip_K_m)}, 2)")
    return np.asarray(np.asarray(tip_K_m, dtype=np.float64)[:, :2] + np.cumsum(pushed[::-1], axis=0)[::-1])


def _hypotheses(touches: Touches) -> tuple[tuple[Hypothesis, ...], Array]:
    """Return the hypotheses, most probable first, and their weights."""
    ring, boxes, losses = fit_both(touches.current)
    distinct = _distinct(boxes[losses < losses[0] + RECTANGLE_MODE_LOSS])
    scales, loose_priors = [scale for scale, _ in SCATTER_SCALES], [chance for _, chance in SCATTER_SCALES]
    found = infer_posteriors(circle, ring[None].repeat(len(scales), axis=0), [0.0] * len(scales), touches, scales)
    middle = infer_posteriors(circle, ring[None], AMPLITUDES[1:2], touches)[0].corrected
    found += infer_posteriors(circle, middle[None].repeat(len(AMPLITUDES), axis=0), AMPLITUDES, touches)
    plain, more = np.array(distinct[:1] * len(scales) + distinct[1:]), len(distinct) - 1
    found += infer_posteriors(rounded, plain, [0.0] * len(plain), touches, scales + scales[:1] * more)
    found += infer_posteriors(rounded, np.array(distinct[:1] * 2), AMPLITUDES[:2], touches)
    found = _open_sided(found, touches.current)
    prior = [*loose_priors, *[DEVIATION_PRIOR] * len(AMPLITUDES), *loose_priors, *loose_priors[:1] * more]
    prior += [DEVIATION_PRIOR] * 2
    score = TEMPER * np.array([h.log_evidence for h in found]) + np.log(prior)
    weights = np.exp(score - score.max())
    weights /= weights.sum()
    order = [int(i) for i in np.argsort(-weights, kind="stable") if weights[i] > MIN_WEIGHT]
    kept = weights[order]
    return tuple(found[i] for i in order), kept / kept.sum()


def _open_sided(found: list[Hypothesis], touches: Touches) -> list[Hypothesis]:
    """Return the hypotheses, rectangles with larger variance on their untouched sides.

    Contacts bound such a side from inside only, so the Gaussian at the optimum is too narrow. The nearest free position
    beyond the side bounds it from outside.
    """
    known = np.isfinite(touches.normal_sd_rad)
    outward = np.column_stack([np.cos(touches.normal_rad[known]), np.sin(touches.normal_rad[known])])
    opened = []
    for h in found:
        if h.shape is not circle:
            covariance = h.covariance.copy()
            _open_sides(h.corrected, outward, touches.free_m, touches.radius_m, covariance)
            h = replace(h, covariance=covariance)
        opened.append(h)
    return opened


@compiled("f8[:]", "f8[:, ::1]", "f8[:, :]", "f8", "f8[:, ::1]")
def _open_sides(box: Array, outward: Array, free: Array, radius: float, covariance: Array) -> None:
    """Add the variance of the untouched sides of a rectangle (6,) to its covariance; `outward` are normals (k, 2)."""
    step = np.zeros(5)
    for side in range(4):
        angle = box[2] + 0.5 * math.pi * side
        c, s = math.cos(angle), math.sin(angle)
        touched = False
        for j in range(len(outward)):
            touched |= outward[j, 0] * c + outward[j, 1] * s > SIDE_COSINE
        if touched:
            continue
        gap = MAX_OPEN_SIDE_M
        for j in range(len(free)):
            x, y = free[j, 0] - box[0], free[j, 1] - box[1]
            beyond = x * c + y * s - box[3 + side % 2] - radius
            if abs(y * c - x * s) < box[4 - side % 2] + radius and beyond > 0.0:
                gap = min(gap, beyond)
        step[:] = 0.0
        step[0], step[1], step[3 + side % 2] = 0.5 * c, 0.5 * s, 0.5
        for a in range(5):
            for b in range(5):
                covariance[a, b] += (0.5 * gap) ** 2 * step[a] * step[b]


def _distinct(boxes: Array) -> list[Array]:
    """Return the first distinct boxes of (s, 6); a quarter turn with swapped sides is the same box."""
    kept: list[Array] = []
    for p in boxes:
        turns = round(float(p[2]) / (0.5 * math.pi))
        a, b = (p[3], p[4]) if turns % 2 == 0 else (p[4], p[3])
        like = np.array([p[0], p[1], (p[2] - turns * 0.5 * math.pi) * 0.03, a, b, p[5]])
        same = np.array([p[0], p[1], -like[2] if abs(like[2]) > 0.02 else like[2], b, a, p[5]])
        if all(min(np.abs(like - q).max(), np.abs(same - q).max()) > 0.002 for q in kept):
            kept.append(like)
        if len(kept) == MAX_RECTANGLE_MODES:
            break
    return [np.array([q[0], q[1], q[2] / 0.03, q[3], q[4], q[5]]) for q in kept]


def _nearest_free(free: Array, touches: Touches) -> Array:
    """Return the innermost free position of each sector about the likely middle, excluding those near a contact."""
    middle = touches.prior_centre_m
    if len(touches.tips_m) > 2:
        middle = 0.5 * (touches.tips_m.min(axis=0) + touches.tips_m.max(axis=0))
    off = free[nearest_distance(free, touches.tips_m) > 0.5 * touches.radius_m] - middle
    distance = np.linalg.norm(off, axis=1)
    off, distance = off[distance < MAX_FREE_DISTANCE_M], distance[distance < MAX_FREE_DISTANCE_M]
    sector = np.floor((np.arctan2(off[:, 1], off[:, 0]) / (2 * math.pi) + 0.5) * FREE_SECTORS).astype(int)
    order = np.argsort(distance, kind="stable")
    _, first = np.unique(sector[order], return_index=True)
    return np.asarray(middle + off[order[first]])


def _directions(name: str, given: Array | None, k: int) -> Array:
    """Return unit vectors (k, 2); zeros where unknown."""
    if given is None:
        return np.zeros((k, 2))
    d = np.nan_to_num(np.asarray(given, dtype=np.float64))
    if d.ndim != 2 or len(d) != k or d.shape[1] not in (2, 3):
        raise ParamError(name, d.shape, f"one direction a contact, ({k}, 2) or ({k}, 3)")
    norm = np.linalg.norm(d[:, :2], axis=1, keepdims=True)
    return np.where(norm > 1e-6, d[:, :2] / np.maximum(norm, 1e-6), 0.0)
