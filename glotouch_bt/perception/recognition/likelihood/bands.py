"""Likelihood of a twin that differs from the target by height bands: a waist, a belt, a taper, another size.

The twin of `volumes.width_ratios` differs locally, so it also explains scatter of widths by tilt or deformation. A band
differs equally from all sides, so closures with a common residual distinguish a twin from a bad closure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.volumes import T_PEAK, Observed, WidthVolumes, log_sum, width_kernel
from glotouch_bt.robot import Array

BAND_M = 5e-3
"""Height of a band, from its lowest closure; layers are 12 mm apart."""
STEP_M = 3e-3
"""Maximum change of the residual over half a grid cell; beyond it the closure is at a step and is ignored."""
MOVED_M = np.linspace(-9e-3, 9e-3, 37)
"""Grid of width differences of a twin: three standard deviations."""


@dataclass(frozen=True)
class Residual:
    """Width residual of one closure near the best pose.

    Attributes:
        off_m: (3, 3) measured minus predicted width at yaws and height offsets half a cell around the best; the grid
            error of the pose is common to all closures.
        scale_m: Scale of its noise.
        height_m: Height of the pads.
        known: Probability that the model predicts the width at all.
        log_width: Log density of the width otherwise, of any object.
    """

    off_m: Array
    scale_m: float
    height_m: float
    known: float = 1.0
    log_width: float = 0.0


def residual(volumes: WidthVolumes, k: int, seen: Observed, at: tuple[int, int, int]) -> Residual | None:
    """Return the residual of closure k at the best (yaw, shift, height offset); None if undefined."""
    off_m = volumes.off_m[k]
    i, d, z = at
    middle = float(off_m[i, d, z])
    if not math.isfinite(middle):
        return None
    n, last = len(off_m), off_m.shape[2] - 1
    beside = off_m[[[(i + k) % n] for k in (-1, 0, 1)], d, [[max(z - 1, 0), z, min(z + 1, last)]]].astype(np.float64)
    half = 0.5 * (middle + np.where(np.isfinite(beside), beside, middle))
    if np.ptp(half) > STEP_M:
        return None
    return Residual(
        half, float(volumes.scale_m[k, i, d, z]), seen.layer.height_m, float(volumes.known[k, i, d, z]), seen.log_width
    )


def log_banded_twin(felt: list[Residual], bias_m: Array, log_bias: Array, p: LikelihoodParams) -> float:
    """Return log p(widths | banded twin) - log p(widths | target), not tempered; 0 without widths.

    Each band differs with probability `twin_width`, by a Student's t of scale `twin_width_sd_m`. Both likelihoods are
    marginalised over the aperture bias and the pose within its grid cell.

    Args:
        felt: Residuals of two-sided layers.
        bias_m, log_bias: (nb,) aperture biases and their log probabilities.
        p: Parameters.
    """
    if not felt:
        return 0.0
    order = sorted(felt, key=lambda r: r.height_m)
    starts = [0]
    for i, r in enumerate(order):
        if r.height_m - order[starts[-1]].height_m >= BAND_M:
            starts.append(i)
    scale = np.array([r.scale_m for r in order], dtype=np.float32)[:, None, None]
    off = np.array([r.off_m.reshape(-1) for r in order])[:, :, None] - bias_m  # (layers, poses, biases)
    off = off.reshape(len(order), -1, 1).astype(np.float32)
    moved = np.append(MOVED_M, 0.0).astype(np.float32)
    peak = np.float32((1 - p.width_outlier) * T_PEAK) / scale
    density = peak * width_kernel((off - moved) / scale) + np.float32(p.width_outlier / p.width_range_m)
    if any(r.known < 1.0 for r in order):
        known = np.array([r.known for r in order], dtype=np.float32)[:, None, None]
        other = np.exp([r.log_width for r in order], dtype=np.float32)[:, None, None]
        density = known * density + (1 - known) * other
    by_band = np.add.reduceat(np.log(density), starts, axis=0)  # (bands, poses * biases, moves + unmoved)
    unmoved = by_band[..., -1]
    weight = width_kernel(MOVED_M / p.twin_width_sd_m)
    different = log_sum((by_band[..., :-1] + np.log(weight / weight.sum())).astype(np.float32), 2)
    twin = np.logaddexp(math.log1p(-p.twin_width) + unmoved, math.log(p.twin_width) + different)
    prior = np.tile(log_bias, off.shape[1] // len(log_bias))
    return float(np.logaddexp.reduce(twin.sum(axis=0) + prior) - np.logaddexp.reduce(unmoved.sum(axis=0) + prior))
