"""Statistics of one depth map: contact mask, support patches, nonplanarity, evidence weight (paper IV-A)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.perception.touch.values import PAD_NOISE_M, Layer
from glotouch_bt.robot import Array, ParamError, TactileFrame

MIN_NOISE_RATIO = 3.0
"""Minimum indentation of a local contact over the noise of the untouched pad. Source: ours."""
MIN_TAXELS = 12
"""Minimum number of taxels of a patch: enough for a plane (three parameters) despite dead taxels."""
BILATERAL = 1.0
"""Evidence weight of a layer with both pads in contact."""
UNILATERAL = 0.4
"""Evidence weight of a layer with one pad in contact. Own choice; the paper gives an order, no numbers."""
INVALID = 0.0
"""Evidence weight of an unstable layer or one without contact."""


@dataclass(frozen=True)
class PatchStats:
    """Contact statistics of one pad.

    Attributes:
        valid: At least one support patch is large enough.
        mask: (rows, cols) taxels of the valid patches, bool.
        patches: Number of valid patches.
        area_fraction: Taxels of valid patches over all working taxels.
        rho: Relative nonplanarity RMS(D - plane) / q90(D) of the largest patch; NaN if not valid.
    """

    valid: bool
    mask: np.typing.NDArray[np.bool_]
    patches: int
    area_fraction: float
    rho: float


def contact_threshold_m(noise_m: float, mean_m: float) -> float:
    """Return the minimum indentation of a contact in one map.

    Smooth noise averages out over a pad. So a mean above the noise proves a contact, of which shallow parts count too:
    a flat side on a stiff gel is nowhere deeper than the noise's peaks.

    Args:
        noise_m: RMS of the pad's untouched map.
        mean_m: Mean of the map.
    """
    noise_m = max(noise_m, PAD_NOISE_M)
    return noise_m if mean_m > noise_m else MIN_NOISE_RATIO * noise_m


def mean_depth_m(depth_m: Array) -> float:
    """Return the mean over the working taxels of a map; 0 without one."""
    known = depth_m[np.isfinite(depth_m)]
    return float(known.mean()) if known.size else 0.0


def pad_noise_m(frames: Sequence[TactileFrame]) -> tuple[float, float]:
    """Return the RMS of the (left, right) maps of untouched pads, m; `PAD_NOISE_M` for a pad without a map.

    The median over time is taken first. So white noise counts little, and errors that persist count whole.
    """
    if not frames:
        return PAD_NOISE_M, PAD_NOISE_M
    left, right = temporal_median(frames, frames[0].left_m.shape)
    return _rms_m(left), _rms_m(right)


def _rms_m(depth_m: Array) -> float:
    known = depth_m[np.isfinite(depth_m)]
    return float(np.sqrt(np.mean(known**2))) if known.size else PAD_NOISE_M


def temporal_median(frames: Sequence[TactileFrame], shape: tuple[int, int]) -> tuple[Array, Array]:
    """Return the taxel-wise median over time of left and right maps, (rows, cols), m; NaN for taxels without data.

    Raises:
        ParamError: A frame of another shape.
    """
    for f in frames:
        if f.left_m.shape != shape or f.right_m.shape != shape:
            raise ParamError("frames", (f.left_m.shape, f.right_m.shape), f"maps of shape {shape}")
    if not frames:
        return np.full(shape, np.nan), np.full(shape, np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # an all-NaN taxel stays NaN by design
        left, right = (
            np.nanmedian(np.stack(m), axis=0) for m in zip(*((f.left_m, f.right_m) for f in frames), strict=True)
        )
    return np.asarray(left), np.asarray(right)


def patch_statistics(depth_m: Array, *, noise_m: float = PAD_NOISE_M, min_taxels: int = MIN_TAXELS) -> PatchStats:
    """Compute statistics of a depth map (eq. relative_nonplanarity).

    Args:
        depth_m: (rows, cols) m, positive indented, NaN dead.
        noise_m: RMS of the pad's untouched map.
        min_taxels: Size of the smallest patch.
    """
    depth = np.asarray(depth_m, dtype=np.float64)
    alive = np.isfinite(depth)
    threshold_m = contact_threshold_m(noise_m, mean_depth_m(depth))
    touched = alive & (np.nan_to_num(depth, nan=0.0) > threshold_m)
    # Bridge dead taxels for the labelling, so that they do not split a patch.
    bridged = touched | (~alive & scipy.ndimage.binary_dilation(touched))
    labels, count = scipy.ndimage.label(bridged)
    sizes = np.bincount(labels[touched], minlength=count + 1)
    sizes[0] = 0
    large = sizes >= min_taxels
    mask = touched & large[labels]
    if not mask.any():
        return PatchStats(False, mask, 0, 0.0, float("nan"))
    largest = touched & (labels == int(np.argmax(sizes)))
    return PatchStats(
        valid=True,
        mask=mask,
        patches=int(np.count_nonzero(large)),
        area_fraction=float(mask.sum() / max(int(alive.sum()), 1)),
        rho=relative_nonplanarity(depth, largest),
    )


def relative_nonplanarity(depth_m: Array, mask: np.typing.NDArray[np.bool_]) -> float:
    """Return the RMS residual to the least-squares plane over the 90th percentile of the depth, on a mask."""
    rows, cols = np.nonzero(mask)
    values = depth_m[mask]
    q90 = float(np.quantile(values, 0.9))
    if len(values) < 3 or q90 <= 0:
        return float("nan")
    basis = np.column_stack([rows - rows.mean(), cols - cols.mean(), np.ones(len(rows))])
    plane = basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(np.sqrt(np.mean((values - plane) ** 2)) / q90)


def layer_patches(layer: Layer) -> tuple[PatchStats, PatchStats]:
    """Return the statistics of the left and the right map of a layer, each above its pad's noise."""
    left, right = (
        patch_statistics(d, noise_m=noise_m)
        for d, noise_m in zip((layer.left_m, layer.right_m), layer.noise_m, strict=True)
    )
    return left, right


def evidence_weight(layer: Layer) -> float:
    """Return the evidence weight of a layer by the number of pads in contact; INVALID if unstable."""
    if not layer.stable:
        return INVALID
    sides = sum(p.valid for p in layer_patches(layer))
    return (INVALID, UNILATERAL, BILATERAL)[sides]
