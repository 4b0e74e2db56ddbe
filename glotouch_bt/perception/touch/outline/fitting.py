"""Circle and oriented rectangle fitted to ball centres: damped Gauss-Newton from many starts.

The centre of a touching ball is at signed distance r from the shape, for any approach or force direction. So the OFFSET
shape is fitted to ball centres, which is exact at corners too. The force direction adds weak evidence about the normal
(friction turns it by 6-13 degrees), which matters with one to four contacts.

Every shape is fitted as a rounded rectangle: a plain one has corner radius 0; a circle has yaw 0 and half sides equal
to the corner radius.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.touch.outline.primitives import (
    CORNER_M,
    FREE_SD_M,
    INWARD_COSINE,
    INWARD_LOSS,
    MAX_SIZE_M,
    MIN_SIZE_M,
    TYPICAL_M,
    Shape,
    Touches,
    circle,
    prior,
    rectangle,
    rounded,
)
from glotouch_bt.robot import Array

SCALE_M = 0.001
"""Residual at which the soft-L1 loss becomes linear: contact scatter plus deviation of real objects from primitives."""
SIFT_STEP = 4
"""Step of the descent after which only the best starts continue."""
SIFTED = 5
"""Number of starts that continue."""
LONGEST_M = 0.02
"""Maximum displacement of a centre in one step of the descent, per axis. Source: ours."""
LONGEST_RAD = 0.3
"""Maximum turn in one step of the descent. Source: ours."""
STEPS = 14
"""Maximum number of steps of the descent. Source: ours."""
GAIN = 1e-2
"""Reduction of the loss by a step below which the descent ends. Source: ours; evidence is compared in nats."""
CIRCLE, RECTANGLE, ROUNDED = 0, 1, 2
"""Kinds of shapes for the compiled descent."""
_KIND: dict[Shape, int] = {circle: CIRCLE, rectangle: RECTANGLE, rounded: ROUNDED}
_COLUMNS: dict[Shape, Sequence[int]] = {circle: (0, 1, 3), rectangle: (0, 1, 2, 3, 4), rounded: (0, 1, 2, 3, 4, 5)}


def fit(shape: Shape, touches: Touches, *, steps: int = STEPS, gain: float = GAIN) -> tuple[Array, Array]:
    """Minimise the soft-L1 loss from many starts; return optima (s, p) and losses (s,), best first."""
    starts = _round_starts(touches) if shape is circle else _rectangle_starts(touches)
    params, loss, _ = descend(starts, np.full(len(starts), _KIND[shape]), touches, 0, steps, gain)
    order = np.argsort(loss, kind="stable")
    order = order[np.isfinite(loss[order])]
    return np.take(params[order], _COLUMNS[shape], axis=1), loss[order]


def fit_both(touches: Touches) -> tuple[Array, Array, Array]:
    """Return the best circle (3,) and the rounded rectangles of `fit`, from one joint descent."""
    rounds, boxes = _round_starts(touches), _rectangle_starts(touches)
    n = len(rounds)
    kinds = np.repeat([CIRCLE, ROUNDED], [n, len(boxes)])
    params, loss, _ = descend(np.concatenate([rounds, boxes]), kinds, touches, n, STEPS, GAIN)
    order = n + np.argsort(loss[n:], kind="stable")
    order = order[np.isfinite(loss[order])]
    best = params[int(np.argmin(loss[:n]))]
    return np.take(best, _COLUMNS[circle]), params[order], loss[order]


def descend(
    starts: Array, kinds: Array, touches: Touches, kept: int, steps: int, gain: float
) -> tuple[Array, Array, Array]:
    """Return parameters (s, 6), losses (s,) and gradients (s, 6) of local optima.

    Levenberg-Marquardt with iterated reweighting from every start. After `SIFT_STEP` steps only the first `kept` starts
    and the `SIFTED` best others continue; the loss of the rest is infinite. It ends after two consecutive steps that
    gain less than `gain`. The loss ranks optima and accepts steps; its data term is twice the one of the gradient.

    Args:
        starts: (s, 6) rounded rectangles, see `primitives.rounded`; they are clipped to the physical limits.
        kinds: (s,) `CIRCLE`, `RECTANGLE` or `ROUNDED`.
        touches: The contacts.
        kept: Number of first starts that are not sifted.
        steps: Maximum number of steps; without any, the loss and its gradient at the starts.
        gain: Smallest reduction of the loss by a step that counts.
    """
    mean, sd = prior(rounded, touches)
    weight = np.repeat(sd[None] ** -2, len(starts), axis=0)
    weight[kinds == CIRCLE] *= (1.0, 1.0, 0.0, 1.0, 0.0, 0.0)
    weight[kinds == RECTANGLE, 5] = 0.0
    params, loss, gradient = starts.copy(), np.zeros(len(starts)), np.zeros((len(starts), 6))
    _descend(
        params, loss, gradient, np.asarray(kinds, dtype=np.int64), touches.points_m, touches.normal_rad,
        1.0 / touches.normal_sd_rad, touches.approach, touches.radius_m, mean, weight, kept, steps, gain,
    )  # fmt: skip
    return params, loss, gradient


@compiled(
    "f8[:, ::1]", "f8[::1]", "f8[:, ::1]", "i8[::1]", "f8[:, ::1]", "f8[:]", "f8[:]", "f8[:, :]", "f8", "f8[::1]",
    "f8[:, ::1]", "i8", "i8", "f8",
)  # fmt: skip
def _descend(
    params: Array,
    loss: Array,
    gradient: Array,
    kinds: Array,
    points: Array,
    normal: Array,
    known: Array,
    approach: Array,
    radius: float,
    mean: Array,
    weight: Array,
    kept: int,
    steps: int,
    gain: float,
) -> None:
    """See `descend`; `params`, `loss` and `gradient` are filled. `known` (k,) is 1 / the standard deviation of the
    normals."""
    count, contacts = len(params), len(normal)
    trials, hessians = params.copy(), np.zeros((count, 6, 6))
    damping = np.full(count, 1e-2)
    by, turn = np.zeros(6), np.zeros(6)
    slope, curve, lower, move = np.zeros(6), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6)
    loss[:] = np.inf
    idle = 0
    for step in range(steps + 1):
        if step == SIFT_STEP + 1 and count > kept + SIFTED:
            order = kept + np.argsort(loss[kept:], kind="mergesort")
            for i in order[SIFTED:]:
                loss[i] = np.inf
        gained = 0.0
        for i in range(count):
            trial = trials[i]
            if step > 0:
                if not np.isfinite(loss[i]):
                    continue
                # the step of the damped equations, by Cholesky's decomposition
                for a in range(6):
                    for b in range(a + 1):
                        left = hessians[i, a, b]
                        if a == b:
                            left += left * damping[i] + 1e-9
                        for c in range(b):
                            left -= lower[a, c] * lower[b, c]
                        lower[a, b] = np.sqrt(max(left, 1e-12)) if a == b else left / lower[b, b]
                for a in range(6):
                    left = gradient[i, a]
                    for c in range(a):
                        left -= lower[a, c] * move[c]
                    move[a] = left / lower[a, a]
                for a in range(5, -1, -1):
                    left = move[a]
                    for c in range(a + 1, 6):
                        left -= lower[c, a] * move[c]
                    move[a] = left / lower[a, a]
                for a in range(6):
                    longest = LONGEST_M if a < 2 else LONGEST_RAD if a == 2 else np.inf
                    trial[a] = params[i, a] - min(max(move[a], -longest), longest)
            # the physical limits, and those of the kind
            for a in (3, 4):
                trial[a] = min(max(trial[a], 0.5 * MIN_SIZE_M), 0.5 * MAX_SIZE_M)
            trial[5] = min(max(trial[5], 0.0), 0.8 * min(trial[3], trial[4]))
            if kinds[i] == CIRCLE:
                trial[4] = trial[5] = trial[3]
            elif kinds[i] == RECTANGLE:
                trial[5] = 0.0
            total = 0.0
            for a in range(6):
                slope[a] = (trial[a] - mean[a]) * weight[i, a]
                total += 0.5 * (trial[a] - mean[a]) * slope[a]
                for b in range(6):
                    curve[a, b] = weight[i, a] if a == b else 0.0
            cosine, sine = np.cos(trial[2]), np.sin(trial[2])
            inner_x, inner_y = trial[3] - trial[5], trial[4] - trial[5]
            for j in range(len(points)):
                # geometry of `primitives.rounded`
                dx, dy = points[j, 0] - trial[0], points[j, 1] - trial[1]
                x, y = cosine * dx + sine * dy, cosine * dy - sine * dx
                over_x, over_y = abs(x) - inner_x, abs(y) - inner_y
                out_x, out_y = max(over_x, 0.0), max(over_y, 0.0)
                norm = np.sqrt(out_x * out_x + out_y * out_y)
                gap = (norm if norm > 1e-12 else max(over_x, over_y)) - trial[5] - radius
                if j >= contacts and gap >= 0.0:
                    continue
                size = max(norm, 1e-12)
                if norm > 1e-12:
                    grad_x, grad_y = out_x / size, out_y / size
                else:
                    grad_x = 1.0 if over_x >= over_y else 0.0
                    grad_y = 1.0 - grad_x
                gx, gy = np.copysign(grad_x, x), np.copysign(grad_y, y)
                by[0], by[1] = sine * gy - cosine * gx, -(sine * gx + cosine * gy)
                by[2], by[3], by[4], by[5] = gx * y - gy * x, -grad_x, -grad_y, grad_x + grad_y - 1.0
                if kinds[i] == CIRCLE:
                    by[2], by[3], by[4], by[5] = 0.0, -1.0, 0.0, 0.0
                elif kinds[i] == RECTANGLE:
                    by[5] = 0.0
                scale = 1.0 / SCALE_M if j < contacts else 1.0 / FREE_SD_M
                z = gap * scale
                root = np.sqrt(1.0 + z * z)
                total += 2.0 * (root - 1.0)
                for a in range(6):
                    row = by[a] * scale / root
                    slope[a] += row * z
                    for b in range(a + 1):
                        curve[a, b] += row * by[b] * scale
                if j >= contacts:
                    continue
                if -(by[0] * approach[j, 0] + by[1] * approach[j, 1]) > INWARD_COSINE:
                    total += INWARD_LOSS
                if known[j] == 0.0:
                    continue
                beside = 1.0 / size if out_x > 0.0 and out_y > 0.0 else 0.0
                tx, ty = -gy * beside, gx * beside
                turn[0], turn[1] = sine * ty - cosine * tx, -(sine * tx + cosine * ty)
                turn[2] = 1.0 + tx * y - ty * x
                turn[3], turn[4] = -np.copysign(1.0, x) * tx, -np.copysign(1.0, y) * ty
                turn[5] = -turn[3] - turn[4]
                if kinds[i] == CIRCLE:
                    turn[2:] = 0.0
                elif kinds[i] == RECTANGLE:
                    turn[5] = 0.0
                angle = trial[2] + np.arctan2(gy, gx) - normal[j]
                z = (angle + 2.0 * np.pi * np.floor((np.pi - angle) / (2.0 * np.pi))) * known[j]
                root = np.sqrt(1.0 + z * z)
                total += 2.0 * (root - 1.0)
                for a in range(6):
                    row = turn[a] * known[j] / root
                    slope[a] += row * z
                    for b in range(a + 1):
                        curve[a, b] += row * turn[b] * known[j]
            if total < loss[i]:
                if step > 0:
                    gained = max(gained, loss[i] - total)
                loss[i] = total
                damping[i] *= 0.3 if step > 0 else 1.0
                for a in range(6):
                    params[i, a], gradient[i, a] = trial[a], slope[a]
                    for b in range(6):
                        hessians[i, a, b] = curve[a, b]
            else:
                damping[i] *= 5.0
        if step > 0:
            idle = idle + 1 if gained < gain else 0
            if idle == 2:
                break


def _round_starts(touches: Touches) -> Array:
    """Return start circles (s, 6): algebraic fit (Kasa), one about the contacts' mean, and typical ones behind them."""
    tips, r = touches.tips_m, touches.radius_m
    mean = tips.mean(axis=0)
    q = tips - mean
    spread = float(np.sqrt(np.mean(np.sum(q * q, axis=1)))) + 1e-6
    matrix = np.column_stack([2 * q, np.ones(len(q))])
    solution = np.linalg.lstsq(matrix, np.sum(q * q, axis=1), rcond=1e-4)[0]
    offset = solution[:2] * min(1.0, 0.5 * MAX_SIZE_M / (float(np.linalg.norm(solution[:2])) + 1e-9))
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-8)))
    starts = [[*(mean + offset), radius - r], [*mean, spread - r]]
    starts += [[*middle, 0.5 * TYPICAL_M] for middle in _middles(touches)]
    return np.array([[x, y, 0.0, half, half, half] for x, y, half in starts])


def _rectangle_starts(touches: Touches) -> Array:
    """Return start boxes (s, 6): around the contacts at twelve yaws, and typical ones behind them."""
    tips, r = touches.tips_m, touches.radius_m
    starts: list[list[float]] = []
    if len(tips) > 2:
        yaw = np.arange(12) * (np.pi / 24)
        c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        x, y = c * tips[:, 0] + s * tips[:, 1], c * tips[:, 1] - s * tips[:, 0]
        low, high = np.array([x.min(axis=1), y.min(axis=1)]), np.array([x.max(axis=1), y.max(axis=1)])
        (mx, my), half = 0.5 * (low + high), 0.5 * (high - low) - r
        middles = (c[:, 0] * mx - s[:, 0] * my, s[:, 0] * mx + c[:, 0] * my)
        starts = np.column_stack([*middles, yaw, *half, np.full(len(yaw), CORNER_M)]).tolist()
    for middle in _middles(touches):
        push = middle - tips.mean(axis=0)
        back = float(np.arctan2(push[1], push[0]))
        starts += [[*middle, back + t, 0.5 * TYPICAL_M, 0.5 * TYPICAL_M, CORNER_M] for t in (-0.5, 0.0, 0.5, np.pi / 4)]
    return np.array(starts)


def _middles(touches: Touches) -> list[Array]:
    """Return possible centres; without normals and approaches, one on each side of collinear contacts."""
    if bool(np.isfinite(touches.normal_sd_rad).any()):
        return [touches.prior_centre_m]
    mean = touches.tips_m.mean(axis=0)
    across = np.linalg.svd(touches.tips_m - mean, full_matrices=True)[2][1]
    return [mean + 0.5 * TYPICAL_M * across, mean - 0.5 * TYPICAL_M * across]
