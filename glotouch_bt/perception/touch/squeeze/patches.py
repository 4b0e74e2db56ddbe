"""Statistics of one depth map: contact mask, support patches, nonplanarity, evidence weight (paper IV-A)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.perception.touch.values import Layer
from glotouch_bt.robot import Array

THRESHOLD_M = 8e-5
"""Minimum indentation of a contact: four standard deviations of a taxel in the nominal conditions (0.02 mm)."""
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


def patch_statistics(depth_m: Array, *, threshold_m: float = THRESHOLD_M, min_taxels: int = MIN_TAXELS) -> PatchStats:
    """Compute statistics of a depth map (rows, cols), m, positive indented, NaN dead (eq. relative_nonplanarity)."""
    depth = np.asarray(depth_m, dtype=np.float64)
    alive = np.isfinite(depth)
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


def evidence_weight(layer: Layer) -> float:
    """Return the evidence weight of a layer by the number of pads in contact; INVALID if unstable."""
    if not layer.stable:
        return INVALID
    sides = sum(patch_statistics(d).valid for d in (layer.left_m, layer.right_m))
    return (INVALID, UNILATERAL, BILATERAL)[sides]
