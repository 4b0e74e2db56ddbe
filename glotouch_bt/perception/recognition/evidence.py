"""Evidence of a TouchSet: rigid widths and pad images of its valid layers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from glotouch_bt.perception.recognition.model import PadSpec, hand_axes, image_feature, pool
from glotouch_bt.perception.touch import Layer, TouchSet, contact_threshold_m, mean_depth_m
from glotouch_bt.robot import Array

MIN_AREA_M2 = 6e-6
"""Minimum area of a connected contact patch."""
EXTENT_RATIO = 0.5
"""Depth over the threshold of contact down to which a patch extends, but not into the noise (hysteresis threshold:
J. Canny, 1986). Its peak exceeds the threshold. Source: ours."""
ONE_SIDED = 0.35
"""Weight of a layer with one pad in contact, relative to 1 for both."""


@dataclass(frozen=True)
class LayerEvidence:
    """One layer that carries evidence.

    Attributes:
        sequence: Index of the sequence.
        index: Index within the sequence.
        width_m: Rigid width: aperture plus both indentations.
        weight: 1 with both pads in contact, `ONE_SIDED` with one.
        upper_only: Only one pad in contact: `width_m` is an upper bound of the width in the window.
        yaw_rad: Yaw of the hand in K.
        along_m: x_P coordinate of the hand's middle, from the contour's centre.
        height_m: Height of the pads' mid-point.
        images: (left, right) features (35,); None for a pad without contact.
        sunk_m: (left, right) indentation of the highest point.
        relief: (2, 2, 7, 5) relief of both pads' images; None without images.
    """

    sequence: int
    index: int
    width_m: float
    weight: float
    upper_only: bool
    yaw_rad: float
    along_m: float
    height_m: float
    images: tuple[Array | None, Array | None]
    sunk_m: tuple[float, float]
    relief: Array | None = None


@dataclass(frozen=True)
class Evidence:
    """Evidence of one TouchSet.

    Attributes:
        layers: Layers that carry evidence.
        yaw_rad: (K,) yaw of each sequence in K.
        weight: Number of two-sided layers plus the weights of the others, which together count at most 1.
    """

    layers: tuple[LayerEvidence, ...]
    yaw_rad: Array
    weight: float


def read_evidence(touchset: TouchSet, pad: PadSpec) -> Evidence:
    """Extract the evidence of a TouchSet. Unstable, non-finite and contact-free layers are skipped (paper IV-A).

    Raises:
        ParamError: A depth map has fewer than 7 x 5 taxels.
    """
    centre = touchset.candidate.contour.centre_K_m
    used = [
        (k, h, layer)
        for k, sequence in enumerate(touchset.sequences)
        for h, layer in enumerate(sequence.layers)
        if _usable(layer)
    ]
    maps = [d for *_, layer in used for d in (layer.left_m, layer.right_m)]
    noise_m = [
        math.sqrt(float(np.mean(np.square(n)))) for n in zip(*(layer.noise_m for *_, layer in used), strict=True)
    ]
    tops = contact_tops(maps, noise_m * len(used), pad)
    layers = []
    for i, (k, h, layer) in enumerate(used):
        sunk = (tops[2 * i], tops[2 * i + 1])
        felt = sum(s > 0 for s in sunk)
        if felt == 0:
            continue
        left, right = (
            np.asarray(image_feature(pool(d)), dtype=np.float64) if s > 0 else None
            for d, s in zip((layer.left_m, layer.right_m), sunk, strict=True)
        )
        yaw, z, width = float(layer.yaw_rad), layer.height_m, layer.aperture_m + sum(sunk)
        along = float(hand_axes(np.asarray(layer.yaw_rad))[0] @ (np.asarray(layer.position_K_m) - centre))
        weight = 1.0 if felt == 2 else ONE_SIDED
        layers.append(LayerEvidence(k, h, width, weight, felt < 2, yaw, along, z, (left, right), sunk, layer.relief))
    both = sum(e.weight for e in layers if not e.upper_only)
    one = min(sum(e.weight for e in layers if e.upper_only), 1.0)
    return Evidence(tuple(layers), np.array([s.yaw_rad for s in touchset.sequences]), both + one)


def _usable(layer: Layer) -> bool:
    numbers = (layer.aperture_m, layer.height_m, layer.yaw_rad, *np.ravel(layer.position_K_m))
    flat = layer.left_m.ndim == 2 and layer.right_m.ndim == 2
    return bool(layer.stable and flat and np.shape(layer.position_K_m) == (2,) and all(map(math.isfinite, numbers)))


def contact_tops(maps_m: list[Array], noise_m: list[float], pad: PadSpec) -> list[float]:
    """Return the maximum indentation in each map's largest patch of contact, 0 without; map shapes may differ.

    A 3 x 3 median removes single outliers. A map with more than half of its taxels dead counts as no contact.

    Args:
        maps_m: Depth maps (rows, cols), m.
        noise_m: RMS of each map's pad when untouched.
        pad: The pad.
    """
    out = [0.0] * len(maps_m)
    shapes = {m.shape for m in maps_m}
    for shape in shapes:
        where = [i for i, m in enumerate(maps_m) if m.shape == shape]
        stack = np.stack([maps_m[i] for i in where]).astype(np.float64)
        threshold_m = np.array([contact_threshold_m(noise_m[i], mean_depth_m(maps_m[i])) for i in where])[:, None, None]
        good = np.isfinite(stack)
        alive = good.mean(axis=(1, 2)) >= 0.5
        middle = [float(np.median(m[g])) if a else 0.0 for m, g, a in zip(stack, good, alive, strict=True)]
        filled = np.where(good, stack, np.array(middle)[:, None, None])
        smooth = scipy.ndimage.median_filter(filled, size=(1, 3, 3), mode="nearest")
        flat = np.zeros((3, 3, 3))
        flat[1] = [[0, 1, 0], [1, 1, 1], [0, 1, 0]]
        extent_m = np.maximum(EXTENT_RATIO * threshold_m, np.array([noise_m[i] for i in where])[:, None, None])
        labels, n = scipy.ndimage.label((smooth > extent_m) & alive[:, None, None], structure=flat)
        if n == 0:
            continue
        count = np.bincount(labels.ravel(), minlength=n + 1)
        peak = np.append(0.0, scipy.ndimage.maximum(smooth, labels, np.arange(1, n + 1)))
        least = MIN_AREA_M2 * shape[0] * shape[1] / (pad.window_m[0] * pad.window_m[1])
        for i, label, limit in zip(where, labels, threshold_m.ravel(), strict=True):
            own = np.unique(label)
            own = own[(own > 0) & (count[own] >= least) & (peak[own] > limit)]
            if len(own):
                out[i] = float(peak[own[np.argmax(count[own])]])
    return out
