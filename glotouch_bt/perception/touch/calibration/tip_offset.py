"""Offset of the tip in the hand, from wall contacts at several yaws, and latency of the wrist sensor.

Each wall contact gives one equation

    a . x + u . b - v e = w - r

with a the unit approach in K, x the nominal ball centre at the onset, u the approach in P, b the tip error in P,
v the speed, e the unknown excess of the latency over its assumed value, w the wall's position along a and r the ball's
radius. The walls are unknowns, so the registration of the container cancels. The system is linear, so the covariance is
exact for Gaussian noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.robot import Array, ParamError

TIP_ERROR_PRIOR_SD_M = 0.005
"""Prior standard deviation of the tip error, per axis. Well above real errors; it regularises a single yaw."""
SMOOTH_S = 0.004
"""Standard deviation of the Gaussian that smooths both signals before the delay is estimated; the motion is slower."""


@dataclass(frozen=True)
class WallTouch:
    """One touch of one wall.

    Attributes:
        wall: Index of the wall, from 0.
        approach: (2,) unit direction of approach in K.
        tip_m: (2,) nominal ball centre in K at the onset, dated with the assumed latency.
        approach_P: (2,) the direction of approach in P's x and y.
        speed_m_s: Speed at the onset.
    """

    wall: int
    approach: Array
    tip_m: Array
    approach_P: Array
    speed_m_s: float


@dataclass(frozen=True)
class TipCalibration:
    """Result of the tip calibration.

    Attributes:
        tip_error_P_m: (2,) true minus nominal tip in P.
        tip_covariance_m2: (2, 2) its covariance.
        late_s: True minus assumed latency.
        late_sd_s: Its standard deviation.
        walls_m: (k,) position of each wall along its approach, in K as registered.
        residuals_m: (n,) residual of each touch.
    """

    tip_error_P_m: Array
    tip_covariance_m2: Array
    late_s: float
    late_sd_s: float
    walls_m: Array
    residuals_m: Array

    @property
    def tip_sd_m(self) -> float:
        """Standard deviation per axis: square root of the mean variance."""
        return float(np.sqrt(0.5 * np.trace(self.tip_covariance_m2)))


def solve_tip(
    touches: Sequence[WallTouch], tip_radius_m: float, *, touch_sd_m: float, late_sd_s: float
) -> TipCalibration:
    """Solve for tip error, latency error and walls by weighted linear least squares.

    Args:
        touches: At least one; walls numbered without gaps.
        tip_radius_m: Radius of the ball.
        touch_sd_m: Standard deviation of an onset position.
        late_sd_s: Prior standard deviation of the latency error, mean 0.

    Raises:
        ParamError: No touches, a missing wall index, or deviations that are not positive.
    """
    if not touches:
        raise ParamError("touches", 0, "at least one")
    walls = max(t.wall for t in touches) + 1
    if {t.wall for t in touches} != set(range(walls)):
        raise ParamError("touches.wall", sorted({t.wall for t in touches}), "numbers from 0 without gaps")
    for name, value in (("touch_sd_m", touch_sd_m), ("late_sd_s", late_sd_s)):
        if not (math.isfinite(value) and value > 0):
            raise ParamError(name, value, "finite and positive")
    rows = np.zeros((len(touches), 3 + walls))
    right = np.zeros(len(touches))
    for row, t in enumerate(touches):
        rows[row, :2] = -np.asarray(t.approach_P)
        rows[row, 2] = t.speed_m_s
        rows[row, 3 + t.wall] = 1.0
        right[row] = float(np.asarray(t.approach) @ np.asarray(t.tip_m)) + tip_radius_m
    prior = np.zeros((3, 3 + walls))
    prior[:, :3] = np.diag([1 / TIP_ERROR_PRIOR_SD_M, 1 / TIP_ERROR_PRIOR_SD_M, 1 / late_sd_s])
    a = np.vstack([rows / touch_sd_m, prior])
    covariance = np.linalg.inv(a.T @ a)
    found = covariance @ (a.T @ np.concatenate([right / touch_sd_m, np.zeros(3)]))
    return TipCalibration(
        tip_error_P_m=found[:2],
        tip_covariance_m2=covariance[:2, :2],
        late_s=float(found[2]),
        late_sd_s=float(np.sqrt(covariance[2, 2])),
        walls_m=found[3:],
        residuals_m=right - rows @ found,
    )


def wrench_delay(
    position_m: Array, force_N: Array, rate_Hz: float, *, max_delay_s: float = 0.02, steps: int = 401
) -> tuple[float, float]:
    """Estimate the delay of the wrist force behind the hand's acceleration: (delay s, standard deviation s).

    In free translation the wrist measures the payload's inertia, F(t) = -m a(t - delay) + constant. Least squares over
    delay, m and the constant, on equally smoothed signals.

    Args:
        position_m: (n,) measured position along the direction of motion, undelayed.
        force_N: (n,) wrist force in this direction at the same stamps.
        rate_Hz: Sampling rate of both.
        max_delay_s: Maximum delay to consider.
        steps: Number of delays to consider.

    Raises:
        ParamError: Wrong shapes, or signals too short.
    """
    x, f = np.asarray(position_m, dtype=np.float64), np.asarray(force_N, dtype=np.float64)
    width = SMOOTH_S * rate_Hz
    edge = round(max_delay_s * rate_Hz + 4 * width)
    if x.ndim != 1 or f.shape != x.shape or len(x) < 4 * edge:
        raise ParamError("position_m, force_N", (x.shape, f.shape), f"both (n,) with n >= {4 * edge}")
    smooth = scipy.ndimage.gaussian_filter1d(x, width)
    acceleration = np.gradient(np.gradient(smooth)) * rate_Hz**2
    measured = _centred(scipy.ndimage.gaussian_filter1d(f, width)[edge:-edge])
    samples = np.arange(len(x), dtype=np.float64)
    delays = np.linspace(0.0, max_delay_s, steps)
    errors, change = np.zeros(steps), np.zeros(steps)
    for k, delay in enumerate(delays):
        late = _centred(np.interp(samples - delay * rate_Hz, samples, acceleration)[edge:-edge])
        mass = float(late @ measured) / max(float(late @ late), 1e-12)
        residual = measured - mass * late
        errors[k] = residual @ residual
        change[k] = np.sum((mass * np.gradient(late) * rate_Hz) ** 2)
    best = int(np.argmin(errors))
    delay = float(delays[best])
    if 0 < best < steps - 1:
        before, here, after = errors[best - 1 : best + 2]
        bend = before - 2 * here + after
        if bend > 0:
            delay += float(0.5 * (before - after) / bend) * float(delays[1] - delays[0])
    # Smoothing correlates neighbouring samples; the last factor is the number of samples per independent value.
    variance = errors[best] / len(measured) * max(2 * math.sqrt(math.pi) * width, 1.0)
    return delay, float(np.sqrt(variance / max(change[best], 1e-12)))


def _centred(x: Array) -> Array:
    return np.asarray(x - x.mean())
