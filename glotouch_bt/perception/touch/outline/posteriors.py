"""Gaussian posterior and evidence, in closed form, of a primitive with a smooth periodic deviation (`deviation`).

Linearised at the fitted primitive, the observations are linear in the correction dp of its parameters and in the
coefficients w of the deviation:

    contact         distance + J dp - phi(t) w         = ball radius + noise
    reaction        normal + J_n dp - phi'(t) w / rho  = its bearing + noise
    free position   like a contact, but one-sided: active only while the outline would cover it

So the posterior is a ridge regression and the evidence a determinant. Without coefficients it is the plain primitive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.touch.outline.deviation import (
    COEFFICIENT_SD_M,
    HARMONICS,
    MIN_COSINE,
    REST_SD_M,
    Hypothesis,
)
from glotouch_bt.perception.touch.outline.primitives import (
    FREE_SD_M,
    INWARD_COSINE,
    INWARD_LOSS,
    MAX_SIZE_M,
    MIN_SIZE_M,
    Shape,
    Touches,
    circle,
    prior,
)
from glotouch_bt.robot import Array

CORNER_CONTACT_SD_M = 0.0012
"""Minimum standard deviation of a contact at a corner. A recess of a real object looks like a corner and would
fix an untouched end."""
SHIFT_SD_M = 0.008
"""Prior standard deviation of an unobserved displacement of the object, per axis."""
MAX_MISFIT_INCREASE = 1.0
"""Maximum increase of the squared misfit by a correction, in variances; rounded corners cause about this much."""
ROUNDS = 4
"""Maximum number of times that further free positions become active. Source: ours."""
HARMONIC_COUNT = len(HARMONICS)
"""Number of harmonics; there are a cosine and a sine coefficient for each."""


def infer_posteriors(
    shape: Shape, params: Array, amplitudes: Sequence[float], touches: Touches, scatter_scales: Sequence[float] = (1.0,)
) -> list[Hypothesis]:
    """Compute the posteriors at fitted primitives, all at once.

    Args:
        shape: `circle` or `rounded`.
        params: (s, p) linearisation points.
        amplitudes: Amplitudes of the deviations, (s,); all zero or all positive.
        touches: The contacts.
        scatter_scales: Factors on the contacts' standard deviation, (s,) or one for all.
    """
    s, p, k = *params.shape, len(touches.tips_m)
    amplitude = np.asarray(amplitudes, dtype=np.float64)
    before, sd = prior(shape, touches)
    free = ~np.isfinite(sd)
    offset = np.where(free, 0.0, before - params)
    sd[free] = math.sqrt(math.pi / 8)  # the density of a yaw anywhere in a quarter turn
    spread = COEFFICIENT_SD_M if shape is circle else np.minimum(COEFFICIENT_SD_M, COEFFICIENT_SD_M[2])
    own = p + (2 * HARMONIC_COUNT if amplitude[0] > 0 else 0)
    n = own + (2 if touches.outliers else 0)
    mean, covariance, residuals, evidence = np.zeros((s, n)), np.zeros((s, n, n)), np.zeros((s, k)), np.zeros(s)
    _condition(
        np.ascontiguousarray(params), amplitude, np.broadcast_to(np.asarray(scatter_scales, dtype=np.float64), s),
        touches.points_m, touches.normal_rad, 1.0 / touches.normal_sd_rad, touches.approach, touches.radius_m,
        touches.contact_sd_m, touches.outliers, offset, sd, spread, mean, covariance, residuals, evidence,
    )  # fmt: skip
    return [
        Hypothesis(
            shape, params[i], float(amplitude[i]), mean[i, :own], covariance[i, :own, :own], float(evidence[i]),
            residuals[i], touches.radius_m,
        )
        for i in range(s)
    ]  # fmt: skip


@compiled(
    "f8[:, ::1]", "f8[:]", "given f8[:]", "f8[:, ::1]", "f8[:]", "f8[:]", "f8[:, :]", "f8", "f8", "i8", "f8[:, ::1]",
    "f8[::1]", "f8[::1]", "f8[:, ::1]", "f8[:, :, ::1]", "f8[:, ::1]", "f8[::1]",
)  # fmt: skip
def _condition(
    params: Array,
    amplitude: Array,
    scale: Array,
    points: Array,
    normal: Array,
    known: Array,
    approach: Array,
    radius: float,
    contact_sd: float,
    moved: int,
    offset: Array,
    sd: Array,
    spread: Array,
    mean: Array,
    covariance: Array,
    residuals: Array,
    evidence: Array,
) -> None:
    """See `infer_posteriors`; the last four are filled.

    Args:
        params, amplitude, scale: (s, p), (s,), (s,).
        points: (k + m, 2) contacts, then free positions.
        normal, known, approach: (k,) bearings of the outward normals, rad; (k,) 1 / their standard deviations, 0 if
            unknown; (k, 2) unit directions of approach.
        radius, contact_sd: Of the ball, and of its centre at a contact.
        moved: Number of first contacts made before the object moved by a common, unknown shift.
        offset, sd: (s, p), (p,) prior of the correction.
        spread: (h,) prior standard deviation of the coefficients at amplitude 1.
    """
    count, shape_size = params.shape
    n, contacts = mean.shape[1], len(normal)
    is_circle = shape_size == 3
    rows, turn = np.zeros((len(points), n)), np.zeros(n)
    noise, gap = np.zeros(contacts), np.zeros(len(points))
    active = np.zeros(len(points), dtype=np.bool_)
    full, lower, inverse = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    right, x, trial = np.zeros(n), np.zeros(n), np.zeros(shape_size)
    for i in range(count):
        deviating = amplitude[i] > 0.0
        full[:] = 0.0
        right[:] = 0.0
        square = log_sd = inward = 0.0
        for a in range(n):
            if a < shape_size:
                its = sd[a]
            elif deviating and a < shape_size + 2 * HARMONIC_COUNT:
                its = amplitude[i] * spread[(a - shape_size) % HARMONIC_COUNT]
            else:
                its = SHIFT_SD_M
            full[a, a] = 1.0 / (its * its)
            log_sd += np.log(its)
            if a < shape_size:
                right[a] = offset[i, a] * full[a, a]
                square += offset[i, a] * right[a]
        yaw = 0.0 if is_circle else params[i, 2]
        c, s = np.cos(yaw), np.sin(yaw)
        for j in range(len(points)):
            row = rows[j]
            # distance and normal as in `primitives.circle` and `primitives.rounded`
            dx, dy = points[j, 0] - params[i, 0], points[j, 1] - params[i, 1]
            corner = False
            if is_circle:
                size = max(np.sqrt(dx * dx + dy * dy), 1e-9)
                row[0], row[1], row[2] = -dx / size, -dy / size, -1.0
                turn[0], turn[1], turn[2] = dy / size / size, -dx / size / size, 0.0
                gap[j], bearing = size - params[i, 2] - radius, np.arctan2(dy, dx)
            else:
                lx, ly, r = c * dx + s * dy, c * dy - s * dx, params[i, 5]
                over_x, over_y = abs(lx) - (params[i, 3] - r), abs(ly) - (params[i, 4] - r)
                out_x, out_y = max(over_x, 0.0), max(over_y, 0.0)
                size = np.sqrt(out_x * out_x + out_y * out_y)
                if size > 1e-12:
                    grad_x, grad_y = out_x / size, out_y / size
                else:
                    grad_x = 1.0 if over_x >= over_y else 0.0
                    grad_y = 1.0 - grad_x
                gx, gy = np.copysign(grad_x, lx), np.copysign(grad_y, ly)
                row[0], row[1], row[2] = s * gy - c * gx, -(s * gx + c * gy), gx * ly - gy * lx
                row[3], row[4], row[5] = -grad_x, -grad_y, grad_x + grad_y - 1.0
                corner = out_x > 0.0 and out_y > 0.0
                beside = 1.0 / max(size, 1e-12) if corner else 0.0
                tx, ty = -gy * beside, gx * beside
                turn[0], turn[1], turn[2] = s * ty - c * tx, -(s * tx + c * ty), 1.0 + tx * ly - ty * lx
                turn[3], turn[4] = -np.copysign(1.0, lx) * tx, -np.copysign(1.0, ly) * ty
                turn[5] = -turn[3] - turn[4]
                gap[j] = (size if size > 1e-12 else max(over_x, over_y)) - r - radius
                bearing = yaw + np.arctan2(gy, gx)
            if deviating:
                rho = np.sqrt(dx * dx + dy * dy)
                at = np.arctan2(dy, dx)
                cosine, sine = np.cos(at), np.sin(at)
                slope = max(np.cos(bearing - at), MIN_COSINE) / max(rho, 0.5 * MIN_SIZE_M)
                wave_c, wave_s = 1.0, 0.0
                for h in range(HARMONIC_COUNT):
                    wave_c, wave_s = wave_c * cosine - wave_s * sine, wave_c * sine + wave_s * cosine
                    row[shape_size + h], row[shape_size + HARMONIC_COUNT + h] = -wave_c, -wave_s
                    turn[shape_size + h] = (h + 1) * wave_s * slope
                    turn[shape_size + HARMONIC_COUNT + h] = -(h + 1) * wave_c * slope
            if moved:
                before = 1.0 if j < moved else 0.0
                for a in range(2):
                    row[n - 2 + a], turn[n - 2 + a] = -before * row[a], -before * turn[a]
            if j >= contacts:
                continue
            its = contact_sd * scale[i]
            if corner:
                its = max(its, CORNER_CONTACT_SD_M)
            if deviating:
                its = np.sqrt(its * its + (amplitude[i] * REST_SD_M) ** 2)
            noise[j] = its
            if -(row[0] * approach[j, 0] + row[1] * approach[j, 1]) > INWARD_COSINE:
                inward += INWARD_LOSS  # the ball would have come from inside
            sharp, y = 1.0 / (its * its), -gap[j]
            angle = normal[j] - bearing
            angle += 2.0 * np.pi * np.floor((np.pi - angle) / (2.0 * np.pi))
            firm = known[j] * known[j]
            square += sharp * y * y + firm * angle * angle
            for a in range(n):
                right[a] += sharp * row[a] * y + firm * turn[a] * angle
                for b in range(a + 1):
                    full[a, b] += sharp * row[a] * row[b] + firm * turn[a] * turn[b]
        active[:] = False
        for attempt in range(ROUNDS + 1):
            # Cholesky's decomposition, and the mean
            for a in range(n):
                for b in range(a + 1):
                    left = full[a, b]
                    for e in range(b):
                        left -= lower[a, e] * lower[b, e]
                    lower[a, b] = np.sqrt(max(left, 1e-300)) if a == b else left / lower[b, b]
            for a in range(n):
                left = right[a]
                for e in range(a):
                    left -= lower[a, e] * x[e]
                x[a] = left / lower[a, a]
            for a in range(n - 1, -1, -1):
                left = x[a]
                for e in range(a + 1, n):
                    left -= lower[e, a] * x[e]
                x[a] = left / lower[a, a]
            new = False
            for j in range(contacts, len(points)):
                if attempt == ROUNDS or active[j]:
                    continue
                over = gap[j]
                for a in range(n):
                    over += rows[j, a] * x[a]
                if over < 0.0:  # the outline would cover it
                    active[j] = new = True
                    sharp = 1.0 / (FREE_SD_M * FREE_SD_M)
                    square += sharp * gap[j] * gap[j]
                    for a in range(n):
                        right[a] -= sharp * rows[j, a] * gap[j]
                        for b in range(a + 1):
                            full[a, b] += sharp * rows[j, a] * rows[j, b]
            if not new:
                break
        determinant, misfit = 2.0 * log_sd, square
        for a in range(n):
            determinant += 2.0 * np.log(lower[a, a])
            misfit -= right[a] * x[a]
        evidence[i] = -0.5 * (max(misfit, 0.0) + determinant) - inward
        for j in range(contacts):
            evidence[i] -= np.log(noise[j])
        # the covariance, from the inverse of the factor
        for b in range(n):
            for a in range(b, n):
                left = 1.0 if a == b else 0.0
                for e in range(b, a):
                    left -= lower[a, e] * inverse[e, b]
                inverse[a, b] = left / lower[a, a]
        for a in range(n):
            for b in range(a + 1):
                total = 0.0
                for e in range(a, n):
                    total += inverse[e, a] * inverse[e, b]
                covariance[i, a, b] = covariance[i, b, a] = total
        # Scale the correction of a plain primitive down until it explains the contacts about as well as none: the
        # linearisation ignores that a side must reach as far as its contacts, so the prior could pull an untouched end
        # in past them.
        share, limit = 1.0, np.inf
        for attempt in range(0 if deviating or moved else 4):
            step = 0.0 if attempt == 0 else share
            misfit = 0.0
            for a in range(shape_size):
                trial[a] = params[i, a] + step * x[a]
                misfit += ((step * x[a] - offset[i, a]) / sd[a]) ** 2
            for a in (2, 2) if is_circle else (3, 4):
                trial[a] = min(max(trial[a], 0.5 * MIN_SIZE_M), 0.5 * MAX_SIZE_M)
            if not is_circle:
                trial[5] = min(max(trial[5], 0.0), 0.8 * min(trial[3], trial[4]))
                c, s = np.cos(trial[2]), np.sin(trial[2])
            for j in range(contacts):
                dx, dy = points[j, 0] - trial[0], points[j, 1] - trial[1]
                if is_circle:
                    off = np.sqrt(dx * dx + dy * dy) - trial[2]
                else:
                    over_x = abs(c * dx + s * dy) - (trial[3] - trial[5])
                    over_y = abs(c * dy - s * dx) - (trial[4] - trial[5])
                    off = np.sqrt(max(over_x, 0.0) ** 2 + max(over_y, 0.0) ** 2)
                    off = (off if off > 1e-12 else max(over_x, over_y)) - trial[5]
                misfit += ((off - radius) / noise[j]) ** 2
            if attempt == 0:
                limit = misfit + MAX_MISFIT_INCREASE
            elif misfit <= limit:
                break
            else:
                share = 0.5 * share if attempt < 3 else 0.0
        for a in range(n):
            mean[i, a] = share * x[a]
        for j in range(contacts):
            residuals[i, j] = gap[j]
            for a in range(n):
                residuals[i, j] += rows[j, a] * mean[i, a]
