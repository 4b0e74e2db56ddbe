"""Circle and oriented rectangle fitted to ball centres: distances, normals, their derivatives, damped Gauss-Newton.

A ball of radius r that touches a shape has its centre at signed distance r from it, whatever the direction of approach
or of the force; so the OFFSET shape is fitted to ball centres, exactly also round a corner. The direction of the force
adds what little it knows about the normal (friction turns it by 6-13 degrees), which matters with one to four contacts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array

SMALLEST_M, LARGEST_M = 0.005, 0.150
"""No outline is smaller or larger: what a 0-85 mm gripper and a hand-sized container hold, with a margin."""
TYPICAL_M, SIZE_SD_M = 0.060, 0.028
"""Prior of every size (diameter, side): objects are 40-110 mm long, and less across."""
CORNER_M, CORNER_SD_M = 0.002, 0.004
"""Prior of a corner's radius."""
PLACE_SD_M = 0.025
"""Prior of the centre about the place half a typical size behind the contacts."""
SCALE_M = 0.001
"""Residual at which the loss turns from squared to linear: contact scatter plus how far real objects deviate."""
CONTACT_SD_M = 0.00045
"""Scatter of a contact unless it is given: of the onset, 0.2-0.4 mm, and of what is nearly a circle or a rectangle."""
NORMAL_SD_RAD, APPROACH_SD_RAD = 0.20, 0.60
"""Scatter of the true outward normal about the reaction, and, where no reaction is known, against the approach."""
SIFT_STEP, SIFTED = 4, 5
"""After so many steps only the best so many starts are followed."""
FREE_SD_M = 0.001
"""How sharply a place where the ball has been forbids the outline."""


@dataclass(frozen=True)
class Touches:
    """What a fit is given, all in one frame of the plane.

    Attributes:
        tips_m: (k, 2) ball centres at the contacts.
        normal_rad: (k,) measured bearing of the outward normal (the reaction's, else against the approach).
        normal_sd_rad: (k,) its scatter; inf where nothing is known.
        approach: (k, 2) unit directions of approach, zeros where not known.
        free_m: (m, 2) places where the ball's centre was without touching; few, near the outline.
        radius_m: Radius of the ball.
        contact_sd_m: Scatter of a ball's centre at the onset, and what a plain primitive may leave of an outline.
        strays: So many of the first contacts were made before the object moved, by a common, unknown shift.
    """

    tips_m: Array
    normal_rad: Array
    normal_sd_rad: Array
    approach: Array
    free_m: Array
    radius_m: float
    contact_sd_m: float = CONTACT_SD_M
    strays: int = 0

    @property
    def rooted(self) -> Touches:
        """Those made since the object moved."""
        s = self.strays
        tips, normal, sd = self.tips_m[s:], self.normal_rad[s:], self.normal_sd_rad[s:]
        return Touches(tips, normal, sd, self.approach[s:], self.free_m, self.radius_m, self.contact_sd_m)

    @property
    def likely_middle_m(self) -> Array:
        """(2,) the middle of what was touched: half a typical object behind each contact."""
        known = np.isfinite(self.normal_sd_rad)[:, None]
        outward = np.stack([np.cos(self.normal_rad), np.sin(self.normal_rad)], axis=1)
        return np.asarray(
            np.mean(self.tips_m - np.where(known, 0.5 * TYPICAL_M + self.radius_m, 0.0) * outward, axis=0)
        )


@dataclass(frozen=True)
class Geometry:
    """Shapes (s) seen from points (k): signed distance (s, k), bearing of the nearest outward normal (s, k), and the
    derivatives (s, k, p) of both by the shapes' parameters."""

    distance_m: Array
    by_params: Array
    normal_rad: Array
    normal_by_params: Array


Shape = Callable[[Array, Array], Geometry]


def circle(params: Array, points_m: Array) -> Geometry:
    """Circles (s, 3) = x, y, radius seen from points (k, 2)."""
    d = points_m[None] - params[:, None, :2]
    norm = np.maximum(np.linalg.norm(d, axis=2), 1e-9)
    unit = d / norm[..., None]
    by = np.concatenate([-unit, -np.ones((*norm.shape, 1))], axis=2)
    turn = np.stack([unit[..., 1] / norm, -unit[..., 0] / norm, np.zeros_like(norm)], axis=2)
    return Geometry(norm - params[:, 2:3], by, np.arctan2(d[..., 1], d[..., 0]), turn)


def rectangle(params: Array, points_m: Array) -> Geometry:
    """Rectangles (s, 5) = x, y, yaw, half sides along and across the yaw, seen from points (k, 2)."""
    c, s = np.cos(params[:, 2, None]), np.sin(params[:, 2, None])
    d = points_m[None] - params[:, None, :2]
    x, y = c * d[..., 0] + s * d[..., 1], c * d[..., 1] - s * d[..., 0]
    sign_x, sign_y = np.where(x < 0, -1.0, 1.0), np.where(y < 0, -1.0, 1.0)
    over_x, over_y = np.abs(x) - params[:, 3, None], np.abs(y) - params[:, 4, None]
    out_x, out_y = np.maximum(over_x, 0.0), np.maximum(over_y, 0.0)
    norm = np.hypot(out_x, out_y)
    outside = norm > 1e-12
    size = np.maximum(norm, 1e-12)
    nearer_x = over_x >= over_y
    grad_x = np.where(outside, out_x / size, nearer_x)
    grad_y = np.where(outside, out_y / size, ~nearer_x)
    gx, gy = sign_x * grad_x, sign_y * grad_y
    distance = np.where(outside, norm, np.maximum(over_x, over_y))
    by = np.stack([-(c * gx - s * gy), -(s * gx + c * gy), gx * y - gy * x, -grad_x, -grad_y], axis=2)
    # The normal turns with the yaw; beside a corner also with the place: by d(atan2(v_y, v_x)) of v from the corner.
    corner = (out_x > 0) & (out_y > 0)
    tx = np.where(corner, -gy / size, 0.0)
    ty = np.where(corner, gx / size, 0.0)
    turn = np.stack([-(c * tx - s * ty), -(s * tx + c * ty), 1.0 + tx * y - ty * x, -sign_x * tx, -sign_y * ty], axis=2)
    return Geometry(distance, by, params[:, 2, None] + np.arctan2(gy, gx), turn)


def rounded(params: Array, points_m: Array) -> Geometry:
    """Rectangles with rounded corners (s, 6) = as `rectangle`, and the corners' radius; seen from points (k, 2).

    What real things have for corners: on a chamfer or a nose a ball is not held against a sharp corner, which would
    fix the end of a box that nothing has touched.
    """
    inner = params[:, :5].copy()
    inner[:, 3:] -= params[:, 5:]
    g = rectangle(inner, points_m)
    # Along a face the radius cancels; on a corner's bisector it moves the outline by sqrt(2) - 1 of itself.
    by_radius = -g.by_params[..., 3] - g.by_params[..., 4] - 1.0
    turn = -g.normal_by_params[..., 3] - g.normal_by_params[..., 4]
    return Geometry(
        g.distance_m - params[:, 5:],
        np.concatenate([g.by_params, by_radius[..., None]], axis=2),
        g.normal_rad,
        np.concatenate([g.normal_by_params, turn[..., None]], axis=2),
    )


def ray_m(params: Array, grown_m: float, origin_m: Array, unit: Array) -> Array:
    """(n,) distance along unit vectors (n, 2) from a place inside to a primitive (p,) grown by `grown_m` all round.

    From a place outside, where a ray may miss it, to where the ray passes nearest.
    """
    if len(params) == 3:
        return _far_root(unit, origin_m - params[:2], params[2] + grown_m)
    c, s = np.cos(params[2]), np.sin(params[2])
    turn = np.array([[c, -s], [s, c]])
    start, u = (origin_m - params[:2]) @ turn, unit @ turn
    radius = params[5] if len(params) == 6 else 0.0
    inner, outer = params[3:5] - radius, params[3:5] + grown_m
    steep = np.where(np.abs(u) > 1e-9, u, np.where(u < 0, -1e-9, 1e-9))
    exits = (np.where(u < 0, -1.0, 1.0) * outer - start) / steep
    side = np.argmin(exits, axis=1)
    t = np.min(exits, axis=1)
    place = start + t[:, None] * u
    other = np.take_along_axis(place, 1 - side[:, None], axis=1)[:, 0]
    rounded_off = np.abs(other) > inner[1 - side]
    corner = np.where(place < 0, -1.0, 1.0) * inner
    return np.asarray(np.where(rounded_off, _far_root(u, start - corner, radius + grown_m), t))


def _far_root(unit: Array, offset: Array, radius: float) -> Array:
    """(n,) where rays from `offset`, (2,) or (n, 2) from a circle's centre, leave the circle."""
    along = np.sum(unit * offset, axis=1)
    square = along**2 - np.sum(offset * offset, axis=-1) + radius**2
    return np.asarray(-along + np.sqrt(np.maximum(square, 0.0)))


def prior(shape: Shape, touches: Touches) -> tuple[Array, Array]:
    """Mean (p,) and sd (p,) of a shape's parameters before any contact; a yaw has none (inf)."""
    half, half_sd = 0.5 * TYPICAL_M, 0.5 * SIZE_SD_M
    middle = touches.likely_middle_m
    if shape is circle:
        return np.array([*middle, half]), np.array([PLACE_SD_M, PLACE_SD_M, half_sd])
    mean, sd = [*middle, 0.0, half, half], [PLACE_SD_M, PLACE_SD_M, np.inf, half_sd, half_sd]
    if shape is rounded:
        mean, sd = [*mean, CORNER_M], [*sd, CORNER_SD_M]
    return np.array(mean), np.array(sd)


def wrapped(angle_rad: Array) -> Array:
    """Angles in (-pi, pi]."""
    return np.asarray(np.pi - np.mod(np.pi - angle_rad, 2 * np.pi))


def fit(shape: Shape, touches: Touches, *, steps: int = 14, gain: float = 1e-2) -> tuple[Array, Array]:
    """Local optima of the soft-L1 loss from many starts: parameters (s, p) and losses (s,), best first.

    Levenberg-Marquardt by iterated reweighting, all starts at once; ends when two steps running gain less than `gain`.
    """
    params = _circle_starts(touches) if shape is circle else _rectangle_starts(touches)
    if shape is rounded:
        params = np.concatenate([params, np.full((len(params), 1), CORNER_M)], axis=1)
    params = clipped(params)
    mean, sd = prior(shape, touches)
    n, first = params.shape[1], 2 if shape is circle else 3
    points = np.concatenate([touches.tips_m, touches.free_m])
    damping = np.full(len(params), 1e-2)
    loss, gradient, hessian = _normal_equations(shape, params, points, touches, mean, sd)
    idle = 0
    for step in range(steps):
        if step == SIFT_STEP and len(params) > SIFTED:
            keep = np.argsort(loss, kind="stable")[:SIFTED]
            params, damping, loss, gradient, hessian = (v[keep] for v in (params, damping, loss, gradient, hessian))
        damped = hessian + (damping[:, None] * np.einsum("sii->si", hessian) + 1e-9)[:, :, None] * np.eye(n)
        move = -np.linalg.solve(damped, gradient[..., None])[..., 0]
        move[:, :2] = np.clip(move[:, :2], -0.02, 0.02)
        move[:, 2:first] = np.clip(move[:, 2:first], -0.3, 0.3)
        trial = clipped(params + move)
        trial_loss, trial_gradient, trial_hessian = _normal_equations(shape, trial, points, touches, mean, sd)
        better = trial_loss < loss
        gained = float(np.max(np.where(better, loss - trial_loss, 0.0)))
        params = np.where(better[:, None], trial, params)
        gradient = np.where(better[:, None], trial_gradient, gradient)
        hessian = np.where(better[:, None, None], trial_hessian, hessian)
        loss = np.where(better, trial_loss, loss)
        damping = np.where(better, 0.3 * damping, 5.0 * damping)
        idle = idle + 1 if gained < gain else 0
        if idle == 2:
            break
    order = np.argsort(loss, kind="stable")
    return params[order], loss[order]


def _normal_equations(
    shape: Shape, params: Array, points: Array, touches: Touches, mean: Array, sd: Array
) -> tuple[Array, Array, Array]:
    """Loss (s,), gradient (s, p) and Gauss-Newton matrix (s, p, p)."""
    k = len(touches.tips_m)
    g = shape(params, points)
    gap = (g.distance_m - touches.radius_m) / SCALE_M
    gap[:, k:] = np.minimum(gap[:, k:], 0.0) * (SCALE_M / FREE_SD_M)
    by = g.by_params / SCALE_M
    by[:, k:] *= (gap[:, k:] < 0.0)[..., None] * (SCALE_M / FREE_SD_M)
    known = 1.0 / touches.normal_sd_rad
    turn = wrapped(g.normal_rad[:, :k] - touches.normal_rad) * known
    z = np.concatenate([gap, turn], axis=1)
    j = np.concatenate([by, g.normal_by_params[:, :k] * known[:, None]], axis=1)
    root = np.sqrt(1.0 + z * z)
    off = (params - mean) / sd
    loss = np.sum(2 * (root - 1.0), axis=1) + 0.5 * np.sum(off**2, axis=1)
    # A contact on a face that looks along its approach would have been made from inside.
    normal = np.stack([np.cos(g.normal_rad[:, :k]), np.sin(g.normal_rad[:, :k])], axis=2)
    loss += 10.0 * np.sum(np.einsum("ski,ki->sk", normal, touches.approach) > 0.3, axis=1)
    weighted = j / root[..., None]
    gradient = np.einsum("skn,sk->sn", weighted, z) + off / sd
    return loss, gradient, np.swapaxes(weighted, 1, 2) @ j + np.diag(1.0 / sd**2)


def clipped(params: Array) -> Array:
    """Parameters (s, p) with sizes and corners within the physical limits; in place."""
    sizes = params[:, 2:3] if params.shape[1] == 3 else params[:, 3:5]
    np.clip(sizes, 0.5 * SMALLEST_M, 0.5 * LARGEST_M, out=sizes)
    if params.shape[1] == 6:
        np.clip(params[:, 5], 0.0, 0.8 * sizes.min(axis=1), out=params[:, 5])
    return params


def _circle_starts(touches: Touches) -> Array:
    """Algebraic circle (Kasa), one about the contacts' mean, and typical ones behind them."""
    tips, r = touches.tips_m, touches.radius_m
    mean = tips.mean(axis=0)
    q = tips - mean
    spread = float(np.sqrt(np.mean(np.sum(q * q, axis=1)))) + 1e-6
    matrix = np.column_stack([2 * q, np.ones(len(q))])
    solution = np.linalg.lstsq(matrix, np.sum(q * q, axis=1), rcond=1e-4)[0]
    offset = solution[:2] * min(1.0, 0.5 * LARGEST_M / (float(np.linalg.norm(solution[:2])) + 1e-9))
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-8)))
    starts = [[*(mean + offset), radius - r], [*mean, spread - r]]
    return np.array(starts + [[*middle, 0.5 * TYPICAL_M] for middle in _middles(touches)])


def _rectangle_starts(touches: Touches) -> Array:
    """Boxes round the contacts at twelve yaws over a quarter turn, and typical ones behind the contacts."""
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
    """Where the middle may be; without normals and approaches, on either side of contacts in a row."""
    if bool(np.isfinite(touches.normal_sd_rad).any()):
        return [touches.likely_middle_m]
    mean = touches.tips_m.mean(axis=0)
    across = np.linalg.svd(touches.tips_m - mean, full_matrices=True)[2][1]
    return [mean + 0.5 * TYPICAL_M * across, mean - 0.5 * TYPICAL_M * across]
