"""Log ratios target : background of one sequence over the grid of nuisance poses.

Axes: (bias, yaw, shift, height offset). Yaw i is the relative yaw phi_i of the FIRST sequence's hand; the other hands
follow from their known yaws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.recognition.evidence import LayerEvidence
from glotouch_bt.perception.recognition.likelihood.background import image_kernel
from glotouch_bt.perception.recognition.likelihood.interpolation import (
    Index,
    interpolated,
    interpolated_widths,
    nearest,
    positions,
)
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.model import POOLED, Array32, TargetModel, span
from glotouch_bt.robot import Array

Floats = npt.NDArray[np.floating]
T_PEAK = 2 / (math.pi * math.sqrt(3))
"""Density of Student's t with three degrees of freedom at 0."""

LAYERS_A_LOG = 4
"""Number of layers whose density ratios are multiplied before their logarithm is taken. Each ratio is between
`width_outlier` and about 1e4, so the product of four stays in the range of 32 bit for a `width_outlier` above 1e-9."""


@dataclass(frozen=True)
class Grid:
    """Grid of nuisance values: bias (nb,), shift (nd,), z0 (nz,), metres."""

    bias_m: Array
    shift_m: Array
    z0_m: Array

    @classmethod
    def of(cls, p: LikelihoodParams, bias_sd_m: float) -> Grid:
        """Build the grid; `bias_sd_m` is the standard deviation of the bias of widths."""
        return cls(
            span(p.bias_span * bias_sd_m, p.bias_steps),
            span(p.shift_limit_m, p.shift_steps),
            span(p.z0_limit_m, p.z0_steps),
        )


@dataclass(frozen=True)
class Observed:
    """One layer with its background log densities of width, (left, right) images and (left, right) reliefs."""

    layer: LayerEvidence
    log_width: float
    log_images: tuple[float, float]
    log_reliefs: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class WidthVolumes:
    """Widths of the layers of a sequence at every pose, each (n, 72, nd, nz).

    Attributes:
        off_m: Measured minus predicted width; -inf where the window is empty.
        scale_m: Scale of its noise.
        known: Probability that the model predicts it.
        unsure_m: The part of the scale that is the model's.
    """

    off_m: Array32
    scale_m: Array32
    known: Array32
    unsure_m: Array32 | None = None


def width_kernel(z: Floats) -> Floats:
    """Return Student's t with three degrees of freedom, normalised to 1 at its peak."""
    near = 1 + z * z * np.float32(1 / 3)
    return np.asarray(1 / (near * near))


def width_ratios(
    model: TargetModel, sequences: Sequence[Sequence[Observed]], turns_rad: Sequence[float], grid: Grid,
    p: LikelihoodParams,
) -> list[tuple[Array32, WidthVolumes]]:  # fmt: skip
    """Return each sequence's log ratios (nb, 72, nd, nz) of widths, summed over layers, and its volumes.

    A width that the model does not know is as that of any object (`Certainty`).
    """
    seen = [o for s in sequences for o in s]
    turn = np.repeat(turns_rad, [len(s) for s in sequences])
    l_m = np.array([o.layer.along_m for o in seen])[:, None] + grid.shift_m
    z_m = np.array([o.layer.height_m for o in seen])[:, None] + grid.z0_m
    # all in (n, nz, nd, 72), the order in memory
    off = np.array([o.layer.width_m for o in seen], dtype=np.float32)[:, None, None, None]
    off = off - interpolated_widths(model, l_m, z_m, turn)
    off[np.isnan(off)] = -np.inf
    sd = np.float32(p.width_rough) * nearest(model.unevenness_m, model, l_m, z_m, turn)
    sd = np.sqrt(sd * sd + np.float32(p.width_sd_m**2))
    known, unsure = np.ones_like(sd), None
    if model.certainty is not None:
        unsure = nearest(model.certainty.width_sd_m, model, l_m, z_m, turn)
        sd = np.hypot(sd, unsure)
        known = nearest(model.certainty.width_known, model, l_m, z_m, turn)
    upper = np.array([o.layer.upper_only for o in seen])
    peak, missed, bias = known * _peak(seen, sd, p), _missed(known, p), grid.bias_m.astype(np.float32)
    found, first = [], 0
    for last in np.cumsum([len(s) for s in sequences]).tolist():
        total = np.zeros((len(bias), *sd.shape[1:]), dtype=np.float32)
        for k in range(first, last, LAYERS_A_LOG):
            some = slice(k, min(k + LAYERS_A_LOG, last))
            total += np.log(_width_products(off[some], sd[some], peak[some], missed[some], upper[some], bias))
        volumes = WidthVolumes(*(x[first:last].transpose(0, 3, 2, 1) for x in (off, sd, known)))
        if unsure is not None:
            volumes = replace(volumes, unsure_m=unsure[first:last].transpose(0, 3, 2, 1))
        found.append((total.transpose(0, 3, 2, 1), volumes))
        first = last
    return found


@compiled(
    "given f4[:, :, :, ::1]",
    "given f4[:, :, :, ::1]",
    "given f4[:, :, :, ::1]",
    "given f4[:, :, :, ::1]",
    "given b1[::1]",
    "given f4[::1]",
)
def _width_products(
    off_m: Array32, sd_m: Array32, peak: Array32, missed: Array32, upper: npt.NDArray[np.bool_], bias_m: Array32
) -> Array32:
    """Return the product (nb, nz, nd, 72) over n layers of peak * `width_kernel` + missed.

    Args:
        off_m, sd_m: (n, nz, nd, 72) measured minus predicted widths without a bias, and their scales.
        peak, missed: (n, nz, nd, 72) density of a width without error and of an outlier, over that of the background.
        upper: (n,) True if the width is only an upper bound.
        bias_m: (nb,) biases.
    """
    product = np.ones((len(bias_m), *off_m.shape[1:]), dtype=np.float32)
    one, third, zero = np.float32(1), np.float32(1 / 3), np.float32(0)
    for k in range(len(off_m)):
        off, sd, top, rest = off_m[k].ravel(), sd_m[k].ravel(), peak[k].ravel(), missed[k].ravel()
        for b in range(len(bias_m)):
            bias, bound, out = bias_m[b], upper[k], product[b].ravel()
            for i in range(len(off)):
                x = off[i] - bias
                x = zero if bound and x > zero else x
                z = x / sd[i]
                near = one + z * z * third
                out[i] *= top[i] / (near * near) + rest[i]
    return product


def twin_ratios(volumes: WidthVolumes, seen: Sequence[Observed], p: LikelihoodParams) -> Array32:
    """Return log ratios (1, 72, nd, nz) of the widths of a twin, summed over layers.

    The twin differs from the target at each closure independently with probability `twin_width`.
    """
    off, sd, known = (x.transpose(0, 3, 2, 1) for x in (volumes.off_m, volumes.scale_m, volumes.known))
    far_sd = np.full((len(seen), 1, 1, 1), p.twin_width_sd_m, dtype=np.float32)
    if volumes.unsure_m is not None:
        far_sd = np.hypot(far_sd, volumes.unsure_m.transpose(0, 3, 2, 1))
    off = np.where(_by_layer([o.layer.upper_only for o in seen]), np.minimum(off, np.float32(0)), off)
    near = width_kernel(off / sd) * _peak(seen, sd, p)
    far = width_kernel(off / far_sd) * _peak(seen, far_sd, p)
    mixed = known * (near + np.float32(p.twin_width) * (far - near)) + _missed(known, p)
    return np.asarray(np.log(mixed).sum(axis=0, keepdims=True).transpose(0, 3, 2, 1))


def _by_layer(values: Sequence[float] | Array) -> Floats:
    """Return values (n,) of layers as (n, 1, 1, 1)."""
    return np.array(values)[:, None, None, None]


def _peak(seen: Sequence[Observed], sd_m: Array32, p: LikelihoodParams) -> Array32:
    """Return the largest density (n, ...) of a width that is no outlier, over that of the background.

    If the other finger touched outside its gel, the width is only an upper bound, and uniform above the object's own.
    """
    scale = (1 - p.width_outlier) * np.exp([-o.log_width for o in seen])
    peak = _by_layer(scale * T_PEAK).astype(np.float32) / sd_m
    for k, o in enumerate(seen):
        if o.layer.upper_only:
            peak[k] = scale[k] / p.width_range_m
    return peak


def _missed(known: Floats, p: LikelihoodParams) -> Floats:
    """Return the density of a width that is an outlier or unknown to the model, over that of the background."""
    outlier = np.float32(p.width_outlier)
    return outlier + (1 - known) * (1 - outlier)


def image_ratios(
    model: TargetModel, sequences: Sequence[Sequence[Observed]], turns_rad: Sequence[float], grid: Grid,
    p: LikelihoodParams,
) -> list[Array32]:  # fmt: skip
    """Return each sequence's log ratios (72, nd, nz) of image densities, pose : background, summed over its images."""
    yaws = len(model.phi_rad)
    totals = np.zeros((len(sequences), len(grid.z0_m), len(grid.shift_m), yaws), dtype=np.float32)
    views = [
        (k, side, o) for k, seen in enumerate(sequences) for o in seen for side in (0, 1)
        if o.layer.images[side] is not None
    ]  # fmt: skip
    if views:
        of, sides = np.array([k for k, *_ in views]), np.array([side for _, side, _ in views])
        right = sides == 1  # as the left pad would have felt it: from the opposite side, with its columns reversed
        features = np.array([o.layer.images[side] for _, side, o in views], dtype=np.float32)
        features[right] = features[right].reshape(-1, *POOLED)[:, :, ::-1].reshape(-1, features.shape[1])
        l_m = np.array([o.layer.along_m for *_, o in views])[:, None] + grid.shift_m
        l_m[right] *= -1
        z_m = np.array([o.layer.height_m for *_, o in views])[:, None] + grid.z0_m
        rolls = (np.rint(np.array(turns_rad)[of] / (2 * np.pi) * yaws).astype(np.int64) + right * (yaws // 2)) % yaws
        squared = _squared_distances(model, features, l_m, z_m, rolls)
        # (kernel / background) (1 - outlier) + outlier
        log_generic = np.array([o.log_images[side] for _, side, o in views])
        good = _by_layer((1 - p.image_outlier) * np.exp(-log_generic)).astype(np.float32)
        missed: Floats = np.asarray(p.image_outlier, dtype=np.float32)
        if model.certainty is not None:
            known = nearest(model.certainty.image_known, model, l_m, z_m, rolls * (2 * np.pi / yaws))
            good, missed = good * known, missed + (1 - known) * (1 - missed)
        for k, ratio in zip(of.tolist(), np.log(image_kernel(squared, p) * good + missed), strict=True):
            totals[k] += ratio
    return list(totals.transpose(0, 3, 2, 1))


def _squared_distances(model: TargetModel, features: Array32, l_m: Array, z_m: Array, rolls: Index) -> Array32:
    """Return mean squared distances (n, nz, nd, 72) of features (n, 35) to the table, interpolated between cells.

    Args:
        model: The target.
        features: Features of n images.
        l_m, z_m: (n, nd) and (n, nz) places of each image.
        rolls: (n,) steps by which the yaws are larger.
    """
    (i, f), (j, g) = positions(model.l_m, l_m), positions(model.z_m, z_m)
    (first_i, cells_i), (first_j, cells_j) = _window(i, len(model.l_m)), _window(j, len(model.z_m))
    cells = _cell_distances(model.images_by_place, features, first_i, first_j, cells_i, cells_j)
    still = np.zeros(len(features), dtype=np.float32)
    return interpolated(cells, i - first_i[:, None], f, j - first_j[:, None], g, rolls, still)


def _window(lower: Index, count: int) -> tuple[Index, int]:
    """Return the first cell (n,) of windows of equal size of an axis that hold cells `lower` (n, m) and the next."""
    size = int(np.ptp(lower, axis=1).max()) + 2
    return np.minimum(lower.min(axis=1), count - size), size


@compiled("given f4[:, :, :, ::1]", "given f4[:, ::1]", "given i8[::1]", "given i8[::1]", "i8", "i8")
def _cell_distances(
    table: Array32, features: Array32, first_i: Index, first_j: Index, cells_i: int, cells_j: int
) -> Array32:
    """Return mean squared distances (n, cells_j, cells_i, 72) of features (n, 35) to windows of a table.

    Args:
        table: (nz, nl, 35, 72) features.
        features: Features of n images.
        first_i, first_j: (n,) first shift and first height of each window.
        cells_i, cells_j: Size of all windows.
    """
    n, size, yaws = len(features), features.shape[1], table.shape[3]
    out = np.zeros((n, cells_j, cells_i, yaws), dtype=np.float32)
    for k in range(n):
        for z in range(cells_j):
            for x in range(cells_i):
                place, total = table[first_j[k] + z, first_i[k] + x], out[k, z, x]
                for m in range(size):
                    row, felt = place[m], features[k, m]
                    for y in range(yaws):
                        off = row[y] - felt
                        total[y] += off * off
    out *= np.float32(1 / size)
    return out


def log_sum(x: Array32, axis: int | tuple[int, ...]) -> Array32:
    """Return the stable log-sum-exp over axes; -inf if all are."""
    top = x.max(axis=axis, keepdims=True)
    safe = np.where(np.isfinite(top), top, np.float32(0))
    return np.asarray(np.log(np.exp(x - safe).sum(axis=axis)) + np.squeeze(safe, axis=axis), dtype=np.float32)


@lru_cache(maxsize=64)
def turn_matrix(yaws: int, sd_rad: float, slip: float) -> Array32:
    """Return the probability (72, 72) of a turn between two yaws: a normal of `sd_rad`, and a uniform part `slip`."""
    step = 2 * math.pi / yaws
    reach = min(max(1, math.ceil(2 * sd_rad / step)), yaws // 2)
    steps = np.arange(-reach, reach + 1)
    weight = np.exp(-0.5 * (steps * step / sd_rad) ** 2)
    row = np.zeros(yaws)
    np.add.at(row, steps, (1 - slip) * weight / weight.sum())
    at = np.arange(yaws)
    return np.asarray(row[at[:, None] - at] + slip / yaws, dtype=np.float32)


def slide_matrix(grid: Grid, p: LikelihoodParams) -> Array32:
    """Return the probability (nd, nd) of shift i in one sequence, given the common shift j."""
    off = (grid.shift_m[:, None] - grid.shift_m[None, :]) / p.slide_sd_m
    weight = np.exp(-0.5 * off**2)
    weight /= weight.sum(axis=0, keepdims=True)
    return np.asarray((1 - p.slip) * weight + p.slip / len(weight), dtype=np.float32)


def marginalised(volume: Array32, shift: Array32, turn: Array32) -> Array32:
    """Marginalise log ratios (nb, 72, nd, nz) over a sequence's own shift and turn; return (nb, 72, n, nz).

    All probabilities have a uniform part, so that no sum is below the range of 32 bit.

    Args:
        volume: Log ratios.
        shift: Probability (nd, n) of a shift given n common ones, or (nd, 72) given the yaw: then n = 1.
        turn: `turn_matrix`.
    """
    x = volume.transpose(0, 3, 2, 1)  # the order in memory
    top = x.max(axis=(2, 3), keepdims=True)
    near = np.exp(x - top)
    if shift.shape[1] == near.shape[3]:
        mixed = (near * shift).sum(axis=2, keepdims=True) @ turn
    else:
        mixed = shift.T @ (near @ turn)
    return np.asarray(np.log(mixed) + top, dtype=np.float32).transpose(0, 3, 2, 1)
