"""A twin whose wall is moved at a whole height: a waist, a belt, a taper, another size.

The other twin (`volumes.width_ratios`) differs from place to place, so it also explains widths that scatter because the
object was tilted, turned or pressed in. What differs at a height differs the same way from all sides: closures that are
off together tell a twin from a bad closure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.volumes import T_PEAK, log_sum, width_kernel
from glotouch_bt.perception.recognition.model import Array32
from glotouch_bt.robot import Array

BAND_M = 5e-3
"""Closures within this of the lowest of a band are of one height; layers are 12 mm apart."""
STEP_M = 3e-3
"""Where half a cell of the pose's grid makes so much of a difference, the closure straddles a step: it says nothing."""
MOVED_M = np.linspace(-9e-3, 9e-3, 37)
"""How far the wall may be moved: three standard deviations."""


@dataclass(frozen=True)
class Residual:
    """One closure's width against the prediction about the best pose.

    Attributes:
        off_m: (3, 3) measured minus predicted, at yaws and height offsets half a cell before, at and behind the best:
            what the pose's grid leaves open is common to all closures too.
        scale_m: Of its scatter.
        height_m: Of the pads.
    """

    off_m: Array
    scale_m: float
    height_m: float


def residual(off_m: Array32, scale_m: Array32, height_m: float, at: tuple[int, int, int]) -> Residual | None:
    """From (72, nd, nz) volumes at the best (yaw, shift, height offset); None for no closure, or on a step."""
    i, d, z = at
    middle = float(off_m[i, d, z])
    if not math.isfinite(middle):
        return None
    n, last = len(off_m), off_m.shape[2] - 1
    beside = off_m[[[(i + k) % n] for k in (-1, 0, 1)], d, [[max(z - 1, 0), z, min(z + 1, last)]]].astype(np.float64)
    half = 0.5 * (middle + np.where(np.isfinite(beside), beside, middle))
    if np.ptp(half) > STEP_M:
        return None
    return Residual(half, float(scale_m[i, d, z]), height_m)


def log_banded_twin(felt: list[Residual], bias_m: Array, log_bias: Array, p: LikelihoodParams) -> float:
    """log p(widths | a twin that differs at heights) - log p(widths | target), not tempered; 0 if nothing was felt.

    Every height differs with probability `twin_width`, by a Student's t of scale `twin_width_sd_m`; both are summed
    over the aperture's bias and what the pose's grid leaves open.

    Args:
        felt: Widths that are not merely bounds.
        bias_m, log_bias: (nb,) values of the aperture's bias, and their log probabilities.
        p: Spreads.
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
    by_band = np.add.reduceat(np.log(density), starts, axis=0)  # (bands, poses * biases, moves + unmoved)
    unmoved = by_band[..., -1]
    weight = width_kernel(MOVED_M / p.twin_width_sd_m)
    different = log_sum((by_band[..., :-1] + np.log(weight / weight.sum())).astype(np.float32), 2)
    twin = np.logaddexp(math.log1p(-p.twin_width) + unmoved, math.log(p.twin_width) + different)
    prior = np.tile(log_bias, off.shape[1] // len(log_bias))
    return float(np.logaddexp.reduce(twin.sum(axis=0) + prior) - np.logaddexp.reduce(unmoved.sum(axis=0) + prior))
