"""What the contacts made so far say about an object's outline: explanations weighted by evidence.

Circle, rectangle (every distinct optimum), and either with smooth deviations (figures with limbs, a truck).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from glotouch_bt.perception.touch.outline.deviation import Hypothesis, explain
from glotouch_bt.perception.touch.outline.mixture import TEMPER, OutlineBelief
from glotouch_bt.perception.touch.outline.primitives import (
    APPROACH_SD_RAD,
    CONTACT_SD_M,
    NORMAL_SD_RAD,
    Touches,
    circle,
    fit_both,
    rounded,
)
from glotouch_bt.robot import Array, ParamError

__all__ = ["OutlineBelief", "believe_outline", "present_tips"]

AMPLITUDES: tuple[float, ...] = (0.3, 1.0, 2.0)
"""Deviations a circle is given (a rectangle: the first two); scales of the spread over random objects."""
LOOSENESS = ((1.0, 0.3), (2.2, 0.03))
"""A plain circle or rectangle leaves the contacts' scatter, or so many times as much; each with its prior."""
WAVY_CHANCE = 1 / 15
"""Prior of each amplitude."""
MODES, MODE_LOSS = 3, 12.0
"""So many optima of the rectangle are kept, if their loss is within so much of the best one's."""
FREE_BINS = 18
"""Of free places, the nearest to the middle in each of so many sectors forbids the others too."""
SIDE_COSINE = 0.7
"""A side was touched if a contact's normal is so near to its own."""
OPEN_M = 0.030
"""A side that was not may stand farther out by up to this."""
DULL_WEIGHT = 1e-3
"""Hypotheses of less weight are dropped."""
LARGEST_FREE_M = 0.08
"""Free places further from the middle say nothing."""


def believe_outline(
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
    """The belief after k >= 1 contacts with one object.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the onsets, in order of time.
        tip_radius_m: Radius of the ball.
        approach_K: (k, 2) or (k, 3) directions the ball moved in.
        reaction_K: (k, 2) or (k, 3) directions of the force it felt; rows of zeros or NaN are not known.
        pushed_K_m: (k, 2) how far each contact shoved the object; all contacts are moved to where it stands now.
        free_K_m: (m, 2) places the ball's centre has been without touching the object as it stands now.
        contact_sd_m: Scatter of a ball's centre at the onset.
        outliers: So many of the first contacts were made before the object moved, by a common, unknown shift.

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
        tips = present_tips(tips, pushed_K_m)
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


def present_tips(tip_K_m: Array, pushed_K_m: Array) -> Array:
    """(k, 2) ball centres moved along with an object that was shoved by `pushed_K_m` (k, 2) after each contact.

    Raises:
        ParamError: Not one push a contact, or one that is not finite.
    """
    pushed = np.asarray(pushed_K_m, dtype=np.float64)
    if pushed.shape != (len(tip_K_m), 2) or not np.isfinite(pushed).all():
        raise ParamError("pushed_K_m", pushed.shape, f"finite, ({len(tip_K_m)}, 2)")
    return np.asarray(np.asarray(tip_K_m, dtype=np.float64)[:, :2] + np.cumsum(pushed[::-1], axis=0)[::-1])


def _hypotheses(touches: Touches) -> tuple[tuple[Hypothesis, ...], Array]:
    """Explanations, weightiest first, and their weights."""
    ring, boxes, losses = fit_both(touches.rooted)
    distinct = _distinct(boxes[losses < losses[0] + MODE_LOSS])
    loose, loose_chances = [scale for scale, _ in LOOSENESS], [chance for _, chance in LOOSENESS]
    found = explain(circle, ring[None].repeat(len(loose), axis=0), [0.0] * len(loose), touches, loose)
    middle = explain(circle, ring[None], AMPLITUDES[1:2], touches)[0].corrected
    found += explain(circle, middle[None].repeat(len(AMPLITUDES), axis=0), AMPLITUDES, touches)
    plain, more = np.array(distinct[:1] * len(loose) + distinct[1:]), len(distinct) - 1
    found += explain(rounded, plain, [0.0] * len(plain), touches, loose + loose[:1] * more)
    found += explain(rounded, np.array(distinct[:1] * 2), AMPLITUDES[:2], touches)
    found = [h if h.shape is circle else _open_sided(h, touches.rooted) for h in found]
    prior = [*loose_chances, *[WAVY_CHANCE] * len(AMPLITUDES), *loose_chances, *loose_chances[:1] * more]
    prior += [WAVY_CHANCE] * 2
    score = TEMPER * np.array([h.log_evidence for h in found]) + np.log(prior)
    weights = np.exp(score - score.max())
    weights /= weights.sum()
    order = [int(i) for i in np.argsort(-weights, kind="stable") if weights[i] > DULL_WEIGHT]
    kept = weights[order]
    return tuple(found[i] for i in order), kept / kept.sum()


def _open_sided(h: Hypothesis, touches: Touches) -> Hypothesis:
    """A rectangle whose untouched sides may stand farther out.

    The fit puts such a side as far in as the contacts beside it permit: it is held from one side only, which no normal
    distribution about the optimum says. The ball's way beyond it is a bound.
    """
    x, y, yaw, *half = h.corrected[:5]
    covariance = h.covariance.copy()
    known = np.isfinite(touches.normal_sd_rad)
    outward = np.column_stack([np.cos(touches.normal_rad[known]), np.sin(touches.normal_rad[known])])
    for side in range(4):
        angle = yaw + 0.5 * math.pi * side
        normal, along = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        if np.any(outward @ normal > SIDE_COSINE):
            continue
        reach = half[side % 2]
        off = touches.free_m - (x, y)
        beside = np.abs(off @ along) < half[1 - side % 2] + touches.radius_m
        beyond = off[beside] @ normal - reach - touches.radius_m
        room = float(np.min(beyond[beyond > 0.0], initial=OPEN_M))
        step = np.zeros(len(covariance))
        step[:2], step[3 + side % 2] = 0.5 * normal, 0.5
        covariance += (0.5 * room) ** 2 * np.outer(step, step)
    return replace(h, covariance=covariance)


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


def _directions(name: str, given: Array | None, k: int) -> Array:
    """(k, 2) unit vectors; zeros where nothing is known."""
    if given is None:
        return np.zeros((k, 2))
    d = np.nan_to_num(np.asarray(given, dtype=np.float64))
    if d.ndim != 2 or len(d) != k or d.shape[1] not in (2, 3):
        raise ParamError(name, d.shape, f"one direction a contact, ({k}, 2) or ({k}, 3)")
    norm = np.linalg.norm(d[:, :2], axis=1, keepdims=True)
    return np.where(norm > 1e-6, d[:, :2] / np.maximum(norm, 1e-6), 0.0)
