"""Outlines fitted to the ball centres of contacts (paper III-E: eq. circle_fit, and its oriented rectangle).

A ball of radius r that touches a shape has its centre at signed distance r from it, whatever the direction of approach
or of the force. So the OFFSET shape is fitted to ball centres: residual = signed distance - r, exact also round a
corner. Contact points reconstructed from a force 10 degrees off the normal would carry 1.2 mm of error; ball centres
carry none.

Both primitives are fitted by damped Gauss-Newton under a soft-L1 loss, all starts at once. Every size has a weak
prior, so that a side nobody touched gets a plausible length instead of an absurd one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, ParamError
from glotouch_bt.touch.polygons import polygon_distance
from glotouch_bt.touch.tracing import widest_gap
from glotouch_bt.touch.values import Contour

SMALLEST_M, LARGEST_M = 0.005, 0.150
"""No outline is smaller or larger: what a 0-85 mm gripper and a hand-sized container hold, with a margin."""
SCALE_M = 0.001
"""Residual at which the loss turns from squared to linear: contact scatter plus how far real objects deviate."""
TYPICAL_M, LOG_SPREAD = 0.055, 0.5
"""Prior of every size: log-normal about a hand-sized object."""
PRIOR_WEIGHT = 0.5
"""The prior counts as this much of one contact's information; its pull on a well-touched outline is below 0.1 mm."""
BOX_GAIN, ROUND_RMS_M, BOX_RMS_M = 5.0, 0.0016, 0.0022
"""A box needs three things: a circle that does not fit (rms above ROUND_RMS_M), a rectangle that does (rms below
BOX_RMS_M or a quarter of the circle's), and a loss lower by BOX_GAIN, more than two spare parameters gain by chance.
What is neither round nor a box counts as round: it has no long side to align with. Tuned on simulated traces of all
three sorts."""

_Model = Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True)
class _Fit:
    params: Array
    loss: float
    residuals_m: Array


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


def fit_contour(tip_K_m: Array, tip_radius_m: float, *, approach_K: Array | None = None) -> Contour:
    """The circle or the rectangle that the contacts speak for.

    Args:
        tip_K_m: (k, 2) or (k, 3) ball centres at the contacts, k >= 3.
        tip_radius_m: Radius of the ball.
        approach_K: (k, 2) or (k, 3) directions of approach: the object lies ahead. Settles on which side of three
            contacts in a row the object is; not needed once the object has been touched all round.

    Raises:
        ParamError: Fewer than 3 contacts, wrong shapes or values that are not finite.
    """
    tips = np.asarray(tip_K_m, dtype=np.float64)
    if tips.ndim != 2 or len(tips) < 3 or tips.shape[1] not in (2, 3):
        raise ParamError("tip_K_m", tips.shape, "(k, 2) or (k, 3) with k >= 3 contacts")
    tips = tips[:, :2]
    if not np.isfinite(tips).all():
        raise ParamError("tip_K_m", "NaN or infinity inside", "finite")
    ahead = None
    if approach_K is not None:
        ahead = np.asarray(approach_K, dtype=np.float64)[:, :2]
        if ahead.shape != tips.shape:
            raise ParamError("approach_K", ahead.shape, f"one direction a contact, {tips.shape}")
    circle = _fit(_circle, _circle_starts(tips, tip_radius_m, ahead), tips, tip_radius_m, ahead)
    box = _fit(_box, _box_starts(tips, tip_radius_m, ahead), tips, tip_radius_m, ahead)
    if _is_box(circle, box, len(tips)):
        return _box_contour(box)
    return _round_contour(circle)


def fit_kind(tip_K_m: Array, tip_radius_m: float, kind: str) -> Contour:
    """As `fit_contour`, with the class given: "round" or "box" (a calibration square, say)."""
    tips = np.asarray(tip_K_m, dtype=np.float64)[:, :2]
    if len(tips) < 3 or kind not in ("round", "box"):
        raise ParamError("tip_K_m, kind", (tips.shape, kind), "at least 3 contacts, and 'round' or 'box'")
    if kind == "round":
        return _round_contour(_fit(_circle, _circle_starts(tips, tip_radius_m, None), tips, tip_radius_m, None))
    return _box_contour(_fit(_box, _box_starts(tips, tip_radius_m, None), tips, tip_radius_m, None))


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


def _is_box(circle: _Fit, box: _Fit, k: int) -> bool:
    round_rms = float(np.sqrt(np.mean(circle.residuals_m**2)))
    box_rms = float(np.sqrt(np.mean(box.residuals_m**2)))
    if k < 5 or round_rms < ROUND_RMS_M or circle.loss - box.loss < BOX_GAIN:
        return False
    return box_rms < max(BOX_RMS_M, 0.25 * round_rms)


def _round_contour(fit: _Fit) -> Contour:
    x, y, radius = fit.params
    rms = float(np.sqrt(np.mean(fit.residuals_m**2)))
    return Contour("round", np.array([x, y]), (float(2 * radius), float(2 * radius)), 0.0, rms, fit.residuals_m)


def _box_contour(fit: _Fit) -> Contour:
    x, y, yaw, a, b = fit.params
    if b > a:
        a, b, yaw = b, a, yaw + 0.5 * np.pi
    yaw = float((yaw + 0.5 * np.pi) % np.pi - 0.5 * np.pi)
    rms = float(np.sqrt(np.mean(fit.residuals_m**2)))
    return Contour("box", np.array([x, y]), (float(2 * a), float(2 * b)), yaw, rms, fit.residuals_m)


def _circle(params: Array, points: Array) -> tuple[Array, Array]:
    """Signed distance (s, k) and its derivatives (s, k, 3) for params (s, 3) = x, y, radius."""
    d = points[None] - params[:, None, :2]
    norm = np.maximum(np.linalg.norm(d, axis=2), 1e-9)
    return norm - params[:, 2:3], np.concatenate([-d / norm[..., None], -np.ones((*norm.shape, 1))], axis=2)


def _box(params: Array, points: Array) -> tuple[Array, Array]:
    """Signed distance (s, k) and its derivatives (s, k, 5) for params (s, 5) = x, y, yaw, half long, half short."""
    c, s = np.cos(params[:, 2, None]), np.sin(params[:, 2, None])
    d = points[None] - params[:, None, :2]
    local = np.stack([c * d[..., 0] + s * d[..., 1], -s * d[..., 0] + c * d[..., 1]], axis=2)
    over = np.abs(local) - params[:, None, 3:5]
    out = np.maximum(over, 0.0)
    norm = np.sqrt(np.sum(out * out, axis=2))
    inner = np.max(over, axis=2)
    outside = norm > 1e-12
    distance = np.where(outside, norm, inner)
    face = (over == inner[..., None]).astype(np.float64)
    face[..., 1] *= 1.0 - face[..., 0]
    grad = np.where(outside[..., None], out / np.maximum(norm, 1e-12)[..., None], face)
    g = grad * np.where(local < 0, -1.0, 1.0)
    world = np.stack([c * g[..., 0] - s * g[..., 1], s * g[..., 0] + c * g[..., 1]], axis=2)
    turn = g[..., 0] * local[..., 1] - g[..., 1] * local[..., 0]
    return distance, np.concatenate([-world, turn[..., None], -grad], axis=2)


def _circle_starts(tips: Array, r: float, ahead: Array | None) -> Array:
    """Algebraic circle (Kasa), and one about the middle of the contacts, shifted ahead if that is known."""
    mean = tips.mean(axis=0)
    q = tips - mean
    spread = float(np.sqrt(np.mean(np.sum(q * q, axis=1)))) + 1e-6
    matrix = np.column_stack([2 * q, np.ones(len(q))])
    solution = np.linalg.lstsq(matrix, np.sum(q * q, axis=1), rcond=1e-4)[0]
    offset = solution[:2] * min(1.0, 0.5 * LARGEST_M / (float(np.linalg.norm(solution[:2])) + 1e-9))
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-8)))
    starts = [[*(mean + offset), radius - r], [*mean, spread - r]]
    starts += [[*(mean + push), 0.5 * TYPICAL_M] for push in _pushes(q, ahead)]
    return _clip(np.array(starts))


def _box_starts(tips: Array, r: float, ahead: Array | None) -> Array:
    """Bounding boxes of the contacts at twelve yaws over a quarter turn, and the same pushed to either side."""
    starts = []
    mean = tips.mean(axis=0)
    pushes = _pushes(tips - mean, ahead)
    for yaw in np.arange(12) * (np.pi / 24):
        c, s = np.cos(yaw), np.sin(yaw)
        rotation = np.array([[c, s], [-s, c]])
        local = tips @ rotation.T
        low, high = local.min(axis=0), local.max(axis=0)
        half = 0.5 * (high - low) - r
        starts.append([*(0.5 * (low + high) @ rotation), yaw, *half])
    for push in pushes:
        yaw = float(np.arctan2(push[1], push[0]))
        starts += [[*(mean + push), yaw + t, 0.5 * TYPICAL_M, 0.5 * TYPICAL_M] for t in (0.0, np.pi / 4)]
    return _clip(np.array(starts))


def _pushes(q: Array, ahead: Array | None) -> list[Array]:
    """Where the centre may be from the mean contact, for contacts that lie nearly in a row."""
    if ahead is not None:
        mean = ahead.mean(axis=0)
        return [0.5 * TYPICAL_M * mean / max(float(np.linalg.norm(mean)), 1e-9)]
    across = np.linalg.svd(q, full_matrices=True)[2][1]
    return [0.5 * TYPICAL_M * across, -0.5 * TYPICAL_M * across]


def _clip(params: Array) -> Array:
    """Keep half sizes (every column after the pose) within the physical limits."""
    first = 2 if params.shape[1] == 3 else 3
    params[:, first:] = np.clip(params[:, first:], 0.5 * SMALLEST_M, 0.5 * LARGEST_M)
    return params


def _fit(model: _Model, starts: Array, tips: Array, r: float, ahead: Array | None, steps: int = 25) -> _Fit:
    """Best of all starts: Levenberg-Marquardt on the soft-L1 loss (iteratively reweighted), all starts at once."""
    params = starts.copy()
    n = params.shape[1]
    first = 2 if n == 3 else 3
    damping = np.full(len(params), 1e-2)
    loss, gradient, hessian = _normal_equations(model, params, tips, r, first)
    for _ in range(steps):
        diagonal = np.einsum("sii->si", hessian)
        damped = hessian + (damping[:, None] * diagonal + 1e-9)[:, :, None] * np.eye(n)
        move = -np.linalg.solve(damped, gradient[..., None])[..., 0]
        move[:, :2] = np.clip(move[:, :2], -0.02, 0.02)
        move[:, 2:first] = np.clip(move[:, 2:first], -0.3, 0.3)
        trial = _clip(params + move)
        trial_loss, trial_gradient, trial_hessian = _normal_equations(model, trial, tips, r, first)
        better = trial_loss < loss
        gained = float(np.max(np.where(better, loss - trial_loss, 0.0)))
        params = np.where(better[:, None], trial, params)
        gradient = np.where(better[:, None], trial_gradient, gradient)
        hessian = np.where(better[:, None, None], trial_hessian, hessian)
        loss = np.where(better, trial_loss, loss)
        damping = np.where(better, 0.3 * damping, 5.0 * damping)
        if gained < 1e-7 and bool(np.all(better | (damping > 1e2))):
            break
    score = loss
    if ahead is not None:
        # A contact on a face that looks along its approach would have been made from inside.
        _, jacobian = model(params, tips)
        score = loss + 10.0 * np.sum(np.einsum("ski,ki->sk", -jacobian[..., :2], ahead) > 0.3, axis=1)
    best = int(np.argmin(score))
    distance, _ = model(params[best : best + 1], tips)
    return _Fit(params[best], float(score[best]), distance[0] - r)


def _normal_equations(model: _Model, params: Array, tips: Array, r: float, first: int) -> tuple[Array, Array, Array]:
    """Loss (s,), gradient (s, n) and Gauss-Newton matrix (s, n, n) of soft-L1 residuals and size priors."""
    distance, jacobian = model(params, tips)
    z = (distance - r) / SCALE_M
    root = np.sqrt(1.0 + z * z)
    weight = 1.0 / root
    scaled = jacobian / SCALE_M
    sizes = params[:, first:]
    prior = np.log(2 * sizes / TYPICAL_M) / LOG_SPREAD
    loss = np.sum(2 * (root - 1.0), axis=1) + PRIOR_WEIGHT * np.sum(prior**2, axis=1)
    weighted = scaled * weight[..., None]
    gradient = np.einsum("skn,sk->sn", weighted, z)
    hessian = np.einsum("skn,skm->snm", weighted, scaled)
    slope = 1.0 / (LOG_SPREAD * sizes)
    gradient[:, first:] += PRIOR_WEIGHT * prior * slope
    index = np.arange(first, params.shape[1])
    hessian[:, index, index] += PRIOR_WEIGHT * slope**2
    return loss, gradient, hessian
