"""Circle and oriented rectangle fitted to ball centres: distances, normals, derivatives, damped Gauss-Newton.

The centre of a touching ball is at signed distance r from the shape, for any approach or force direction. So the OFFSET
shape is fitted to ball centres, which is exact at corners too. The force direction adds weak evidence about the normal
(friction turns it by 6-13 degrees), which matters with one to four contacts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glotouch_bt.robot import Array

MIN_SIZE_M = 0.005
"""Minimum size of an outline: below what an 85 mm gripper handles, with a margin."""
MAX_SIZE_M = 0.150
"""Maximum size of an outline: above what an 85 mm gripper and the container hold, with a margin."""
TYPICAL_M = 0.060
"""Prior mean of every size (diameter, side). Source: objects are 40-110 mm long, and less across."""
SIZE_SD_M = 0.028
"""Prior standard deviation of every size."""
CORNER_M = 0.002
"""Prior mean of a corner radius."""
CORNER_SD_M = 0.004
"""Prior standard deviation of a corner radius."""
CENTRE_SD_M = 0.025
"""Prior standard deviation of the centre about the point half a typical size behind the contacts."""
SCALE_M = 0.001
"""Residual at which the soft-L1 loss becomes linear: contact scatter plus deviation of real objects from primitives."""
CONTACT_SD_M = 0.00045
"""Default standard deviation of a contact: onset scatter of 0.2-0.4 mm, and deviation from a primitive."""
NORMAL_SD_RAD = 0.20
"""Standard deviation of the outward normal about the reaction."""
APPROACH_SD_RAD = 0.60
"""Standard deviation of the outward normal about the reversed approach, where the reaction is unknown."""
SIFT_STEP = 4
"""Step of the descent after which only the best starts continue."""
SIFTED = 5
"""Number of starts that continue."""
FREE_SD_M = 0.001
"""Standard deviation of the penalty on an outline that covers a free position."""


@dataclass(frozen=True)
class Touches:
    """Data of a fit, in one planar frame.

    Attributes:
        tips_m: (k, 2) ball centres at the contacts.
        normal_rad: (k,) measured bearing of the outward normal (reaction, else reversed approach).
        normal_sd_rad: (k,) its standard deviation; inf where unknown.
        approach: (k, 2) unit directions of approach; zeros where unknown.
        free_m: (m, 2) contact-free positions of the ball's centre; few, near the outline.
        radius_m: Radius of the ball.
        contact_sd_m: Standard deviation of a ball centre, including the deviation from a plain primitive.
        outliers: Number of first contacts made before the object moved by a common, unknown shift.
    """

    tips_m: Array
    normal_rad: Array
    normal_sd_rad: Array
    approach: Array
    free_m: Array
    radius_m: float
    contact_sd_m: float = CONTACT_SD_M
    outliers: int = 0

    @cached_property
    def current(self) -> Touches:
        """The contacts made since the object moved."""
        s = self.outliers
        tips, normal, sd = self.tips_m[s:], self.normal_rad[s:], self.normal_sd_rad[s:]
        return Touches(tips, normal, sd, self.approach[s:], self.free_m, self.radius_m, self.contact_sd_m)

    @cached_property
    def points_m(self) -> Array:
        """(k + m, 2) contacts, then free positions."""
        return np.concatenate([self.tips_m, self.free_m])

    @cached_property
    def prior_centre_m(self) -> Array:
        """(2,) prior mean of the centre: half a typical size behind the contacts."""
        known = np.isfinite(self.normal_sd_rad)[:, None]
        outward = np.stack([np.cos(self.normal_rad), np.sin(self.normal_rad)], axis=1)
        return np.asarray(
            np.mean(self.tips_m - np.where(known, 0.5 * TYPICAL_M + self.radius_m, 0.0) * outward, axis=0)
        )


@dataclass(frozen=True)
class Geometry:
    """Signed distances (s, k) of points from shapes, bearings (s, k) of the nearest outward normals, and the
    derivatives (s, k, p) of both by the parameters. The first two of `by_params` are the negated normal."""

    distance_m: Array
    by_params: Array
    normal_rad: Array
    normal_by_params: Array


Shape = Callable[[Array, Array], Geometry]
"""Function from parameters (s, p) and points, (k, 2) or (s, k, 2), to their geometry."""


def circle(params: Array, points_m: Array) -> Geometry:
    """Return the geometry of circles (s, 3) = x, y, radius."""
    dx, dy = points_m[..., 0] - params[:, :1], points_m[..., 1] - params[:, 1:2]
    norm = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9)
    by, turn = np.zeros((2, *norm.shape, 3))
    ux, uy = dx / norm, dy / norm
    by[..., 0], by[..., 1], by[..., 2] = -ux, -uy, -1.0
    turn[..., 0], turn[..., 1] = uy / norm, -ux / norm
    return Geometry(norm - params[:, 2:3], by, np.arctan2(dy, dx), turn)


def rectangle(params: Array, points_m: Array) -> Geometry:
    """Return the geometry of rectangles (s, 5) = x, y, yaw, half sides along and across the yaw."""
    g = rounded(np.concatenate([params, np.zeros((len(params), 1))], axis=1), points_m)
    return Geometry(g.distance_m, g.by_params[..., :5], g.normal_rad, g.normal_by_params[..., :5])


def rounded(params: Array, points_m: Array) -> Geometry:
    """Return the geometry of rectangles with rounded corners (s, 6) = as `rectangle`, then the corner radius.

    A sharp corner would fix an untouched end of a real object with chamfers. The distance is that from the rectangle
    shrunk by the corner radius, minus the radius.
    """
    c, s = np.cos(params[:, 2:3]), np.sin(params[:, 2:3])
    dx, dy = points_m[..., 0] - params[:, :1], points_m[..., 1] - params[:, 1:2]
    x, y = c * dx + s * dy, c * dy - s * dx
    over_x, over_y = np.abs(x) - (params[:, 3:4] - params[:, 5:]), np.abs(y) - (params[:, 4:5] - params[:, 5:])
    out_x, out_y = np.maximum(over_x, 0.0), np.maximum(over_y, 0.0)
    norm = np.sqrt(out_x * out_x + out_y * out_y)
    outside = norm > 1e-12
    size = np.maximum(norm, 1e-12)
    nearer_x = over_x >= over_y
    grad_x = np.where(outside, out_x / size, nearer_x)
    grad_y = np.where(outside, out_y / size, ~nearer_x)
    gx, gy = np.copysign(grad_x, x), np.copysign(grad_y, y)
    by, turn = np.zeros((2, *norm.shape, 6))
    by[..., 0], by[..., 1], by[..., 2] = s * gy - c * gx, -(s * gx + c * gy), gx * y - gy * x
    by[..., 3], by[..., 4], by[..., 5] = -grad_x, -grad_y, grad_x + grad_y - 1.0
    # The normal depends on the yaw; at a corner also on the position: d(atan2(v_y, v_x)) of v from the corner.
    beside = ((out_x > 0) & (out_y > 0)) / size
    tx, ty = -gy * beside, gx * beside
    turn_x, turn_y = -np.copysign(1.0, x) * tx, -np.copysign(1.0, y) * ty
    turn[..., 0], turn[..., 1], turn[..., 2] = s * ty - c * tx, -(s * tx + c * ty), 1.0 + tx * y - ty * x
    turn[..., 3], turn[..., 4], turn[..., 5] = turn_x, turn_y, -turn_x - turn_y
    distance = np.where(outside, norm, np.maximum(over_x, over_y)) - params[:, 5:]
    return Geometry(distance, by, params[:, 2:3] + np.arctan2(gy, gx), turn)


def ray_m(params: Array, grown_m: float, origin_m: Array, unit: Array) -> Array:
    """Return distances (s, n) along unit vectors (n, 2) from inner points, (2,) or (s, 2), to primitives (s, p)
    dilated by `grown_m`. For a ray from outside that misses, return the distance to its nearest point.
    """
    off = origin_m - params[:, :2]
    if params.shape[1] == 3:
        return _far_root(unit[:, 0], unit[:, 1], off[:, :1], off[:, 1:], params[:, 2:] + grown_m)
    c, s = np.cos(params[:, 2:3]), np.sin(params[:, 2:3])
    x, y = c * off[:, :1] + s * off[:, 1:], c * off[:, 1:] - s * off[:, :1]
    ux, uy = c * unit[:, 0] + s * unit[:, 1], c * unit[:, 1] - s * unit[:, 0]
    radius = params[:, 5:] if params.shape[1] == 6 else np.zeros((len(params), 1))
    exit_x = (np.copysign(params[:, 3:4] + grown_m, ux) - x) / np.copysign(np.maximum(np.abs(ux), 1e-9), ux)
    exit_y = (np.copysign(params[:, 4:5] + grown_m, uy) - y) / np.copysign(np.maximum(np.abs(uy), 1e-9), uy)
    t = np.minimum(exit_x, exit_y)
    at_x, at_y = x + t * ux, y + t * uy
    half_x, half_y = params[:, 3:4] - radius, params[:, 4:5] - radius
    rounded_off = np.where(exit_x <= exit_y, np.abs(at_y) > half_y, np.abs(at_x) > half_x)
    to_x, to_y = x - np.copysign(half_x, at_x), y - np.copysign(half_y, at_y)
    return np.asarray(np.where(rounded_off, _far_root(ux, uy, to_x, to_y, radius + grown_m), t))


def _far_root(ux: Array, uy: Array, x: Array, y: Array, radius: Array) -> Array:
    """Return where rays along (ux, uy) from (x, y), relative to a circle's centre, leave the circle."""
    along, across = ux * x + uy * y, ux * y - uy * x
    return np.asarray(np.sqrt(np.maximum(radius**2 - across * across, 0.0)) - along)


def prior(shape: Shape, touches: Touches) -> tuple[Array, Array]:
    """Return prior mean (p,) and standard deviation (p,) of a shape's parameters; the yaw is free (inf)."""
    half, half_sd = 0.5 * TYPICAL_M, 0.5 * SIZE_SD_M
    middle = touches.prior_centre_m
    if shape is circle:
        return np.array([*middle, half]), np.array([CENTRE_SD_M, CENTRE_SD_M, half_sd])
    mean, sd = [*middle, 0.0, half, half], [CENTRE_SD_M, CENTRE_SD_M, np.inf, half_sd, half_sd]
    if shape is rounded:
        mean, sd = [*mean, CORNER_M], [*sd, CORNER_SD_M]
    return np.array(mean), np.array(sd)


def wrapped(angle_rad: Array) -> Array:
    """Wrap angles to (-pi, pi]."""
    return np.asarray(angle_rad + 2 * np.pi * np.floor((np.pi - angle_rad) / (2 * np.pi)))


def fit(shape: Shape, touches: Touches, *, steps: int = 14, gain: float = 1e-2) -> tuple[Array, Array]:
    """Minimise the soft-L1 loss from many starts; return optima (s, p) and losses (s,), best first."""
    params = _circle_starts(touches) if shape is circle else _rectangle_starts(touches)
    if shape is rounded:
        params = np.concatenate([params, np.full((len(params), 1), CORNER_M)], axis=1)
    mean, sd = prior(shape, touches)
    params, loss = _descend(shape, clipped, clipped(params), touches, mean, sd**-2, 0, steps, gain)
    order = np.argsort(loss, kind="stable")
    return params[order], loss[order]


def fit_both(touches: Touches, *, steps: int = 14, gain: float = 1e-2) -> tuple[Array, Array, Array]:
    """Return the best circle (3,) and the rounded rectangles of `fit`, from one joint descent.

    A circle is a rounded rectangle constrained to yaw 0 with half sides equal to the corner radius.
    """
    rounds, boxes = _circle_starts(touches), _rectangle_starts(touches)
    n = len(rounds)
    params = np.zeros((n + len(boxes), 6))
    params[:n, :2], params[:n, 3:] = rounds[:, :2], rounds[:, 2:]
    params[n:, :5], params[n:, 5] = boxes, CORNER_M
    mean, sd = prior(rounded, touches)
    weight = np.repeat(sd[None] ** -2, len(params), axis=0)
    weight[:n, [2, 4, 5]] = 0.0

    def tied(params: Array, points_m: Array) -> Geometry:
        g = rounded(params, points_m)
        g.by_params[:n, :, 2:] = (0.0, -1.0, 0.0, 0.0)
        g.normal_by_params[:n, :, 2:] = 0.0
        return g

    def bound(params: Array) -> Array:
        params = clipped(params)
        params[:n, 4:] = params[:n, 3:4]
        return params

    params, loss = _descend(tied, bound, bound(params), touches, mean, weight, n, steps, gain)
    order = n + np.argsort(loss[n:], kind="stable")
    best = params[int(np.argmin(loss[:n]))]
    return best[[0, 1, 3]], params[order], loss[order]


def _descend(
    shape: Shape,
    bound: Callable[[Array], Array],
    params: Array,
    touches: Touches,
    mean: Array,
    weight: Array,
    kept: int,
    steps: int,
    gain: float,
) -> tuple[Array, Array]:
    """Return parameters (s, p) and losses (s,) of local optima of the first `kept` starts and the best others.

    Levenberg-Marquardt with iterated reweighting on all starts at once. It ends after two consecutive steps that gain
    less than `gain`.
    """
    identity = np.eye(params.shape[1])
    longest = np.array([0.02, 0.02, 0.3] if params.shape[1] > 3 else [0.02, 0.02])
    damping = np.full(len(params), 1e-2)
    loss, gradient, hessian = normal_equations(shape, params, touches, mean, weight)
    idle = 0
    for step in range(steps):
        if step == SIFT_STEP and len(params) > kept + SIFTED:
            keep = np.r_[:kept, kept + np.argsort(loss[kept:], kind="stable")[:SIFTED]]
            params, damping, loss, gradient, hessian = (v[keep] for v in (params, damping, loss, gradient, hessian))
            weight = weight if weight.ndim == 1 else weight[keep]
        damped = hessian * (1.0 + damping[:, None, None] * identity) + 1e-9 * identity
        move = np.linalg.solve(damped, gradient[..., None])[..., 0]
        move[:, : len(longest)] = np.minimum(np.maximum(move[:, : len(longest)], -longest), longest)
        trial = bound(params - move)
        trial_loss, trial_gradient, trial_hessian = normal_equations(shape, trial, touches, mean, weight)
        better = trial_loss < loss
        gained = float(np.max((loss - trial_loss) * better))
        params[better], loss[better] = trial[better], trial_loss[better]
        gradient[better], hessian[better] = trial_gradient[better], trial_hessian[better]
        damping = damping * np.where(better, 0.3, 5.0)
        idle = idle + 1 if gained < gain else 0
        if idle == 2:
            break
    return params, loss


def normal_equations(
    shape: Shape, params: Array, touches: Touches, mean: Array, weight: Array
) -> tuple[Array, Array, Array]:
    """Return loss (s,), gradient (s, p) and Gauss-Newton matrix (s, p, p) for a prior of mean (p,) and inverse
    variance, (p,) or (s, p)."""
    k = len(touches.tips_m)
    g = shape(params, touches.points_m)
    known = 1.0 / touches.normal_sd_rad
    gap = g.distance_m - touches.radius_m
    gap[:, k:] = np.minimum(gap[:, k:], 0.0)
    scale = np.full(len(touches.points_m), 1.0 / SCALE_M)
    scale[k:] = 1.0 / FREE_SD_M
    z = np.concatenate([gap * scale, wrapped(g.normal_rad[:, :k] - touches.normal_rad) * known], axis=1)
    root = np.sqrt(1.0 + z * z)
    rows = np.concatenate([g.by_params * scale[:, None], g.normal_by_params[:, :k] * known[:, None]], axis=1)
    rows[:, k : len(scale)] *= (gap[:, k:] < 0.0)[..., None]
    off = params - mean
    pull = off * weight
    # This loss ranks optima and accepts steps; its data term is twice the one of the gradient.
    loss = 2.0 * (root.sum(axis=1) - root.shape[1]) + 0.5 * (off * pull).sum(axis=1)
    # Penalise a contact on a face whose normal points along the approach: the ball would have come from inside.
    into = -(g.by_params[:, :k, :2] * touches.approach).sum(axis=2)
    loss += 10.0 * (into > 0.3).sum(axis=1)
    weighted = np.swapaxes(rows / root[..., None], 1, 2)
    gradient = (weighted @ z[..., None])[..., 0] + pull
    hessian = weighted @ rows
    hessian[:, np.arange(params.shape[1]), np.arange(params.shape[1])] += weight
    return loss, gradient, hessian


def clipped(params: Array) -> Array:
    """Clip sizes and corner radii (s, p) to the physical limits, in place."""
    sizes = params[:, 2:3] if params.shape[1] == 3 else params[:, 3:5]
    sizes[:] = np.minimum(np.maximum(sizes, 0.5 * MIN_SIZE_M), 0.5 * MAX_SIZE_M)
    if params.shape[1] == 6:
        params[:, 5] = np.minimum(np.maximum(params[:, 5], 0.0), 0.8 * np.minimum(params[:, 3], params[:, 4]))
    return params


def _circle_starts(touches: Touches) -> Array:
    """Return start circles: algebraic fit (Kasa), one about the contacts' mean, and typical ones behind them."""
    tips, r = touches.tips_m, touches.radius_m
    mean = tips.mean(axis=0)
    q = tips - mean
    spread = float(np.sqrt(np.mean(np.sum(q * q, axis=1)))) + 1e-6
    matrix = np.column_stack([2 * q, np.ones(len(q))])
    solution = np.linalg.lstsq(matrix, np.sum(q * q, axis=1), rcond=1e-4)[0]
    offset = solution[:2] * min(1.0, 0.5 * MAX_SIZE_M / (float(np.linalg.norm(solution[:2])) + 1e-9))
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-8)))
    starts = [[*(mean + offset), radius - r], [*mean, spread - r]]
    return np.array(starts + [[*middle, 0.5 * TYPICAL_M] for middle in _middles(touches)])


def _rectangle_starts(touches: Touches) -> Array:
    """Return start boxes: around the contacts at twelve yaws over a quarter turn, and typical ones behind them."""
    tips, r = touches.tips_m, touches.radius_m
    starts = []
    for yaw in np.arange(12) * (np.pi / 24) if len(tips) > 2 else ():
        c, s = np.cos(yaw), np.sin(yaw)
        rotation = np.array([[c, s], [-s, c]])
        local = tips @ rotation.T
        low, high = local.min(axis=0), local.max(axis=0)
        starts.append([*(0.5 * (low + high) @ rotation), yaw, *(0.5 * (high - low) - r)])
    for middle in _middles(touches):
        push = middle - tips.mean(axis=0)
        yaw = float(np.arctan2(push[1], push[0]))
        starts += [[*middle, yaw + t, 0.5 * TYPICAL_M, 0.5 * TYPICAL_M] for t in (-0.5, 0.0, 0.5, np.pi / 4)]
    return np.array(starts)


def _middles(touches: Touches) -> list[Array]:
    """Return possible centres; without normals and approaches, one on each side of collinear contacts."""
    if bool(np.isfinite(touches.normal_sd_rad).any()):
        return [touches.prior_centre_m]
    mean = touches.tips_m.mean(axis=0)
    across = np.linalg.svd(touches.tips_m - mean, full_matrices=True)[2][1]
    return [mean + 0.5 * TYPICAL_M * across, mean - 0.5 * TYPICAL_M * across]
