"""Outlines of one object from the ball centres of its contacts (paper III-E).

`fit_contour` asks the belief of `belief` for its outline; `fit_kind` fits one given primitive. What they mean by an
outline, and why ball centres instead of contact points, see `primitives`.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.touch.outline.belief import believe_outline
from glotouch_bt.perception.touch.outline.polygons import polygon_distance
from glotouch_bt.perception.touch.outline.primitives import CONTACT_SD_M, Touches, circle, fit, rectangle
from glotouch_bt.perception.touch.outline.tracing import widest_gap
from glotouch_bt.perception.touch.values import Contour
from glotouch_bt.robot import Array, ParamError


def signed_distance(contour: Contour, points_K_m: Array) -> Array:
    """(n,) distance of points (n, 2) in K from the outline; negative inside. Exact for every family."""
    p = np.asarray(points_K_m, dtype=np.float64).reshape(-1, 2)
    if contour.family == "free":
        return polygon_distance(contour.boundary_K_m, p)
    if contour.family == "circle":
        return np.asarray(np.linalg.norm(p - contour.centre_K_m, axis=1) - 0.5 * contour.size_m[0])
    d = p - contour.centre_K_m
    c, s = np.cos(contour.yaw_rad), np.sin(contour.yaw_rad)
    x = np.abs(c * d[:, 0] + s * d[:, 1]) - 0.5 * contour.size_m[0]
    y = np.abs(c * d[:, 1] - s * d[:, 0]) - 0.5 * contour.size_m[1]
    return np.asarray(np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0)) + np.minimum(np.maximum(x, y), 0.0))


def fit_contour(
    tip_K_m: Array, tip_radius_m: float, *, approach_K: Array | None = None, contact_sd_m: float = CONTACT_SD_M
) -> Contour:
    """The outline that the contacts speak for.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the contacts, k >= 3.
        tip_radius_m: Radius of the ball.
        approach_K: (k, 2) or (k, 3) directions of approach: the object lies ahead. Settles on which side of three
            contacts in a row the object is; not needed once the object has been touched all round.
        contact_sd_m: Scatter of a contact.

    Raises:
        ParamError: Fewer than 3 contacts, wrong shapes or values that are not finite.
    """
    if np.ndim(tip_K_m) == 2 and len(tip_K_m) < 3:
        raise ParamError("tip_K_m", np.shape(tip_K_m), "(k, 2) or (k, 3) with k >= 3 contacts")
    return believe_outline(tip_K_m, tip_radius_m, approach_K=approach_K, contact_sd_m=contact_sd_m).contour


def fit_kind(tip_K_m: Array, tip_radius_m: float, kind: str) -> Contour:
    """The circle ("round") or the rectangle ("box": a calibration square, say) that fits best by soft-L1.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the contacts, k >= 3.
        tip_radius_m: Radius of the ball.
        kind: Which of the two.

    Raises:
        ParamError: Fewer than 3 contacts, or an unknown kind.
    """
    tips = np.asarray(tip_K_m, dtype=np.float64)[:, :2]
    k = len(tips)
    if k < 3 or kind not in ("round", "box"):
        raise ParamError("tip_K_m, kind", (tips.shape, kind), "at least 3 contacts, and 'round' or 'box'")
    nothing = np.zeros((k, 2))
    touches = Touches(tips, np.zeros(k), np.full(k, np.inf), nothing, nothing[:0], tip_radius_m)
    shape = circle if kind == "round" else rectangle
    params = fit(shape, touches, steps=30, gain=1e-6)[0][0]
    residuals = shape(params[None], tips).distance_m[0] - tip_radius_m
    rms = float(np.sqrt(np.mean(residuals**2)))
    if kind == "round":
        return Contour("round", params[:2], (float(2 * params[2]), float(2 * params[2])), 0.0, rms, residuals)
    short, long = sorted(float(2 * half) for half in params[3:])
    yaw = float(params[2]) + (0.0 if params[3] >= params[4] else 0.5 * np.pi)
    return Contour("box", params[:2], (long, short), (yaw + 0.5 * np.pi) % np.pi - 0.5 * np.pi, rms, residuals)


def contour_quality(tips_K_m: Array, contour: Contour) -> float:
    """0..1: how well an outline is supported, coverage times fit.

    Coverage falls from 1 (no gap wider than 90 degrees between contacts, seen from the centre) to 0 (all on one side,
    half a turn untouched); fit is 1 / (1 + (rms / 4 mm)^2).
    """
    offset = np.asarray(tips_K_m, dtype=np.float64)[:, :2] - contour.centre_K_m
    _, gap = widest_gap(np.arctan2(offset[:, 1], offset[:, 0]))
    coverage = float(np.clip((np.pi - gap) / (0.5 * np.pi), 0.0, 1.0))
    return coverage / (1.0 + (contour.rms_m / 0.004) ** 2)


def consistent(contour: Contour, tip_K_m: Array, tip_radius_m: float, tolerance_m: float = 0.008) -> bool:
    """True if a ball centred at tip_K_m (2,) could be touching this outline: within `tolerance_m` of its offset."""
    distance = float(signed_distance(contour, np.asarray(tip_K_m, dtype=np.float64)[None, :2])[0])
    return abs(distance - tip_radius_m) <= tolerance_m
