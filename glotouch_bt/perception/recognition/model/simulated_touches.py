"""Simulated touches of side images: pad images and patch statistics."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from glotouch_bt.perception.recognition.model.pads import FINE, POOLED, Array32, PadSpec, gel_shift, patch_of

LEVELS = 24
"""Number of levels of the height histogram in the gel's force balance."""


def pooled_images(fine_m: Array32, stride: int, pad: PadSpec) -> Array32:
    """Compute the depth in 7 x 5 blocks (row-major, rows downwards) of the left pad at every table cell.

    Args:
        fine_m: (n, fl, fz) side images.
        stride: Raster cells between two table cells.
        pad: Window, gel and force.

    Returns:
        (n, nl, nz, 35) metres. An empty window gives zeros.
    """
    out: list[Array32] = []
    for side in fine_m:
        h = sliding_window_view(side, (FINE[1], FINE[0]))[::stride, ::stride]  # (nl, nz, 15, 21), z upwards
        out.append(touch_windows(h.reshape(-1, FINE[1], FINE[0]), pad).reshape(*h.shape[:2], -1))
    return np.stack(out)


def touch_windows(h: Array32, pad: PadSpec) -> Array32:
    """Compute pooled images (n, 35) of surface heights (n, 15, 21) in a window: along x_P, upwards; -inf: empty."""
    top = h.max(axis=(1, 2), keepdims=True)
    pooled = np.zeros((len(h), POOLED[0] * POOLED[1]), dtype=np.float32)
    some = np.isfinite(top).reshape(-1)
    if not some.any():
        return pooled
    rel = (h - np.where(np.isfinite(top), top, np.float32(0))).reshape(len(h), -1)[some]
    s = _fast_shift(rel, pad)
    x = np.maximum(rel + s, np.float32(0)).reshape(-1, POOLED[1], FINE[1] // POOLED[1], POOLED[0], FINE[0] // POOLED[0])
    mean = x.sum(axis=(2, 4)) / np.float32(FINE[0] * FINE[1] / (POOLED[0] * POOLED[1]))  # (m, 5, 7), rows upwards
    pooled[some] = mean[:, :, ::-1].transpose(0, 2, 1).reshape(len(mean), -1)
    return pooled


def _fast_shift(rel_m: Array32, pad: PadSpec) -> Array32:
    """Compute `gel_shift` with a histogram of the heights: one pass over the cells instead of one per iteration."""
    m = len(rel_m)
    step = pad.depth_m / LEVELS
    level = np.minimum(rel_m * np.float32(-1 / step), np.float32(LEVELS)).astype(np.int32)  # 0 is the top
    index = level + (np.arange(m, dtype=np.int32) * (LEVELS + 1))[:, None]
    count = np.bincount(index.ravel(), minlength=m * (LEVELS + 1)).reshape(m, LEVELS + 1)[:, :LEVELS]
    shifts = np.linspace(0, pad.depth_m, LEVELS + 1)
    x = np.maximum(shifts[:, None] - (np.arange(LEVELS) + 0.5) * step, 0)  # (shifts, levels)
    cell = pad.window_m[0] * pad.window_m[1] / (FINE[0] * FINE[1])
    force = count @ (pad.stiffness_N_m3 * cell * x / (1 - (x / pad.limit_m) ** 2)).T  # (m, shifts), increasing
    over = force >= pad.force_N
    i = np.where(over.any(axis=1), over.argmax(axis=1), LEVELS)
    lo, hi = force[np.arange(m), i - 1], force[np.arange(m), i]
    f = np.clip((pad.force_N - lo) / np.maximum(hi - lo, 1e-9), 0, 1)
    return np.asarray(shifts[i - 1] + f * step, dtype=np.float32)[:, None]


def simulated_statistics(fine_m: Array32, pad: PadSpec) -> tuple[float, float, float]:
    """Return (rho_M, its deviation, d_M) over touches at every third yaw, shifts within 12 mm and four heights."""
    yaws, fl, fz = fine_m.shape
    coarse = PadSpec(pad.window_m, FINE, pad.depth_m, pad.stiffness_N_m3, pad.limit_m, pad.force_N)
    cell = pad.window_m[0] * pad.window_m[1] / (FINE[0] * FINE[1])
    rho: list[float] = []
    spread: list[float] = []
    starts = np.unique(np.linspace(4, max(fz - FINE[0] - 6, 4), 4).astype(int))
    for i in range(0, yaws, 3):
        for shift in (-10, 0, 10):
            a = (fl - FINE[1]) // 2 + shift
            for b in starts:
                h = fine_m[i, max(a, 0) : max(a, 0) + FINE[1], b : b + FINE[0]]
                if h.shape != (FINE[1], FINE[0]) or not np.isfinite(h.max()):
                    continue
                rel = (h - h.max()).astype(np.float64)
                depth = np.clip(rel + gel_shift(rel.reshape(-1), cell, pad.force_N, pad), 0, pad.depth_m)
                patch = patch_of(depth.T[::-1], coarse)
                if patch.valid and np.isfinite(patch.rho):
                    rho.append(patch.rho)
                    spread.append(_normal_dispersion(np.where(np.isfinite(h), h, np.nan), depth, pad))
    if not rho:
        return 0.3, 0.3, 0.0
    low, mid, high = (float(np.quantile(rho, q)) for q in (0.16, 0.5, 0.84))
    return float(mid), float(0.5 * (high - low)), float(np.mean(spread))


def _normal_dispersion(h: Array32, depth: object, pad: PadSpec) -> float:
    heights = h.astype(np.float64)
    gl = np.gradient(heights, pad.window_m[0] / FINE[1], axis=0)
    gz = np.gradient(heights, pad.window_m[1] / FINE[0], axis=1)
    use = (np.asarray(depth) > 6e-5) & np.isfinite(gl) & np.isfinite(gz)
    if not use.any():
        return 0.0
    length = np.sqrt(gl[use] ** 2 + gz[use] ** 2 + 1)
    mean = [float(np.mean(c / length)) for c in (gl[use], gz[use], 1.0)]
    return 1.0 - float(np.hypot(np.hypot(mean[0], mean[1]), mean[2]))
