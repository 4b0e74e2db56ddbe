"""Model of the gel pad: window, Winkler gel, pooled images and nonplanarity of a patch.

Rows of a depth map run downwards, columns along +x_P for both pads (as in `robot.TactileFrame`). SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.robot import Array, ParamError

Array32 = npt.NDArray[np.float32]
POOLED = (7, 5)
"""Rows and columns of a pooled pad image. Source: feasibility study."""
FINE = (21, 15)
"""Rows and columns of the window in the model's raster: three raster cells per pooled cell."""


@dataclass(frozen=True)
class PadSpec:
    """One gel pad and the gel law k x / (1 - (x / limit)^2), pressure in Pa at indentation x.

    Attributes:
        window_m: (width along x_P, length along z_P) of the gel. Source: rizon4.yaml.
        shape: (rows, cols) of the depth maps.
        depth_m: Maximum measured indentation. Source: rizon4.yaml.
        stiffness_N_m3: k. Source: 0.2 N/mm3, assumed.
        limit_m: Indentation at which the gel becomes rigid. Source: assumed.
        force_N: Jaw force of the tables.
    """

    window_m: tuple[float, float] = (0.0172, 0.0285)
    shape: tuple[int, int] = (35, 20)
    depth_m: float = 1.5e-3
    stiffness_N_m3: float = 0.2e9
    limit_m: float = 1.6e-3
    force_N: float = 10.0

    def __post_init__(self) -> None:
        values = (*self.window_m, self.depth_m, self.stiffness_N_m3, self.limit_m, self.force_N)
        if not all(np.isfinite(v) and v > 0 for v in values):
            raise ParamError("pad", values, "finite and positive")
        if self.depth_m > self.limit_m:
            raise ParamError("pad.depth_m", self.depth_m, f"<= limit_m = {self.limit_m}")


def gel_shift(
    heights_m: npt.NDArray[np.floating], cell_m2: float, force_N: float, pad: PadSpec
) -> npt.NDArray[np.floating]:
    """Solve for the indentation s of the highest point: sum k x / (1 - (x/limit)^2) dA = force, x = max(0, h + s).

    Args:
        heights_m: (..., n) heights of the surface relative to its highest point; -inf: empty.
        cell_m2: Area of one of the n cells.
        force_N: Normal force of the pad.
        pad: The gel.

    Returns:
        (..., 1) s in metres, at most `pad.depth_m`: by bisection, because the sum is monotone in s.
    """
    lo = np.zeros((*heights_m.shape[:-1], 1), dtype=heights_m.dtype)
    hi = np.full_like(lo, pad.depth_m)
    target = force_N / (pad.stiffness_N_m3 * cell_m2)
    inverse_square = np.asarray(1.0 / pad.limit_m**2, dtype=heights_m.dtype)
    for _ in range(9):  # 1.5 mm / 2^9 = 3 um
        mid = 0.5 * (lo + hi)
        x = np.maximum(heights_m + mid, 0)
        force = (x / (1 - inverse_square * x * x)).sum(axis=-1, keepdims=True)
        too_much = force > target
        hi = np.where(too_much, mid, hi)
        lo = np.where(too_much, lo, mid)
    return np.asarray(0.5 * (lo + hi))


def pool(depth_m: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """Return the mean depth of 7 x 5 blocks, (..., rows, cols) -> (..., 35); NaN taxels are skipped, dead blocks are 0.

    Raises:
        ParamError: rows or cols are fewer than 7 or 5.
    """
    rows, cols = depth_m.shape[-2:]
    if rows < POOLED[0] or cols < POOLED[1]:
        raise ParamError("depth map shape", (rows, cols), f"at least {POOLED}")
    good = np.isfinite(depth_m)
    value = np.where(good, depth_m, 0)
    a, b = _block_matrix(rows, POOLED[0], depth_m.dtype), _block_matrix(cols, POOLED[1], depth_m.dtype)
    total = a @ value @ b.T
    if bool(good.all()):
        mean = total
    else:
        weight = a @ good.astype(depth_m.dtype) @ b.T
        mean = np.where(weight > 0.2, total / np.maximum(weight, 0.2), 0)
    return mean.reshape(*depth_m.shape[:-2], POOLED[0] * POOLED[1])


def _block_matrix(n: int, blocks: int, dtype: npt.DTypeLike) -> npt.NDArray[np.floating]:
    """Return the averaging matrix (blocks, n); a cell that straddles two blocks is divided between them."""
    edges = np.linspace(0, n, blocks + 1)
    i = np.arange(n)
    cover = np.minimum(i + 1, edges[1:, None]) - np.maximum(i, edges[:-1, None])
    m = np.clip(cover, 0, 1)
    return np.asarray(m / m.sum(axis=1, keepdims=True), dtype=dtype)


def image_feature(pooled_m: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    """Compress depth to sqrt(d + e) - sqrt(e) in sqrt(mm), e = 0.05 mm: balances edges (1 mm) and flats (0.15 mm)."""
    e = np.asarray(0.05, dtype=pooled_m.dtype)
    return np.asarray(np.sqrt(np.maximum(pooled_m * np.asarray(1e3, pooled_m.dtype), 0) + e) - np.sqrt(e))


@dataclass(frozen=True)
class Patch:
    """Support patch of one pad.

    Attributes:
        valid: Large and deep enough for a contact.
        rho: Relative nonplanarity, eq. (relative_nonplanarity); NaN if not valid.
        top_m: Maximum indentation after a 3 x 3 median.
    """

    valid: bool
    rho: float
    top_m: float


def patch_of(depth_m: Array, pad: PadSpec, threshold_m: float = 6e-5, smallest_m2: float = 6e-6) -> Patch:
    """Find the largest connected patch above `threshold_m` in a depth map (rows, cols), and its rho.

    Eq. (relative_nonplanarity): RMS of the residual to the least-squares plane over the 90th percentile of the depth.
    """
    rows, cols = depth_m.shape
    none = Patch(False, float("nan"), 0.0)
    good = np.isfinite(depth_m)
    if good.mean() < 0.5:
        return none
    filled = np.where(good, depth_m, float(np.median(depth_m[good])))
    smooth = scipy.ndimage.median_filter(filled, size=3, mode="nearest")
    labels, n = scipy.ndimage.label(smooth > threshold_m)
    cell = pad.window_m[0] / cols * pad.window_m[1] / rows
    if n == 0:
        return none
    counts = np.bincount(labels.ravel())[1:]
    best = int(np.argmax(counts)) + 1
    if float(counts[best - 1] * cell) < smallest_m2:
        return none
    r, c = np.nonzero((labels == best) & good)
    d = depth_m[r, c]
    top = float(smooth[labels == best].max())
    if len(d) < 4:
        return Patch(True, float("nan"), top)
    a = np.stack([r, c, np.ones(len(r))], axis=1).astype(np.float64)
    residual = d - a @ np.linalg.lstsq(a, d, rcond=None)[0]
    q90 = float(np.quantile(d, 0.9))
    return Patch(True, float(np.sqrt(np.mean(residual**2)) / max(q90, 1e-5)), top)
