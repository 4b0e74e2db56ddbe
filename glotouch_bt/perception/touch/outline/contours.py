"""Contours fitted to the ball centres of one object's contacts (paper III-E)."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.touch.outline.belief import infer_outline
from glotouch_bt.perception.touch.outline.fitting import fit
from glotouch_bt.perception.touch.outline.polygons import polygon_distance
from glotouch_bt.perception.touch.outline.primitives import CONTACT_SD_M, Touches, circle, rectangle
from glotouch_bt.perception.touch.values import Contour
from glotouch_bt.robot import Array, ParamError


def signed_distance(contour: Contour, points_K_m: Array) -> Array:
    """Return signed distances (n,) of points (n, 2) in K from the outline, negative inside; exact for all families."""
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
    """Return the contour of the most probable shape family.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the contacts, k >= 3.
        tip_radius_m: Radius of the ball.
        approach_K: (k, 2) or (k, 3) directions of approach; they resolve the side of collinear contacts.
        contact_sd_m: Standard deviation of a contact.

    Raises:
        ParamError: Fewer than 3 contacts, wrong shapes or values that are not finite.
    """
    if np.ndim(tip_K_m) == 2 and len(tip_K_m) < 3:
        raise ParamError("tip_K_m", np.shape(tip_K_m), "(k, 2) or (k, 3) with k >= 3 contacts")
    return infer_outline(tip_K_m, tip_radius_m, approach_K=approach_K, contact_sd_m=contact_sd_m).contour


def fit_kind(tip_K_m: Array, tip_radius_m: float, kind: str) -> Contour:
    """Fit a circle ("round") or a rectangle ("box", e.g. a calibration square) by soft-L1.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the contacts, k >= 3.
        tip_radius_m: Radius of the ball.
        kind: "round" or "box".

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


def widest_gap(bearings_rad: Array) -> tuple[float, float]:
    """Return (middle, width), rad, of the widest interval between neighbouring bearings (k,); middle in (-pi, pi].

    Raises:
        ParamError: No bearing given.
    """
    b = np.sort(np.mod(np.asarray(bearings_rad, dtype=np.float64).ravel(), 2 * np.pi))
    if len(b) == 0:
        raise ParamError("bearings_rad", 0, "at least one bearing")
    gaps = np.diff(np.append(b, b[0] + 2 * np.pi))
    i = int(np.argmax(np.round(gaps, 9)))
    middle = b[i] + 0.5 * gaps[i]
    return float(np.pi - np.mod(np.pi - middle, 2 * np.pi)), float(gaps[i])


def contour_quality(tips_K_m: Array, contour: Contour) -> float:
    """Return the support of an outline by its contacts, 0..1: coverage times fit.

    Coverage falls from 1 (no gap of bearings wider than 90 degrees) to 0 (a gap of 180 degrees); fit is
    1 / (1 + (rms / 4 mm)^2).
    """
    offset = np.asarray(tips_K_m, dtype=np.float64)[:, :2] - contour.centre_K_m
    _, gap = widest_gap(np.arctan2(offset[:, 1], offset[:, 0]))
    coverage = float(np.clip((np.pi - gap) / (0.5 * np.pi), 0.0, 1.0))
    return coverage / (1.0 + (contour.rms_m / 0.004) ** 2)
