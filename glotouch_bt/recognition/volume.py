"""Losses over the whole grid of nuisance poses at once: one volume a sequence.

Axes of a volume: (bias, common yaw, shift, height offset). Common yaw i means that the FIRST sequence meets the mesh at
relative yaw phi_i; the others follow by the known motion of the hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.recognition.evidence import LayerEvidence
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.recognition.pads import POOLED, Array32
from glotouch_bt.recognition.params import LossParams
from glotouch_bt.robot import Array

Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

NOTHING_FITS = 4.0
"""Width loss, in units, of a pose at which no layer has support."""


@dataclass(frozen=True)
class Grid:
    """The nuisance values tried: bias (nb,), shift (nd,), z0 (nz,), all in metres, and one scale."""

    bias_m: Array
    shift_m: Array
    z0_m: Array
    scale: float

    @classmethod
    def of(cls, p: LossParams, scale: float) -> Grid:
        """The grid of one scale."""

        def span(limit: float, n: int) -> Array:
            return np.linspace(-limit, limit, n) if n > 1 else np.zeros(1)

        return cls(span(p.bias_limit_m, p.bias_steps), span(p.shift_m, p.shift_steps), span(p.z0_m, p.z0_steps), scale)


@dataclass(frozen=True)
class SequenceVolume:
    """One sequence's losses.

    Attributes:
        loss: (nb, 72, nd, nz) width families, coverage and images; priors not yet in.
        residual_m: (H, 72, nd, nz) measured minus predicted width, bias not taken off; NaN without support.
        index: (H,) place of each layer in its sequence.
        weight: (H,) evidence weights.
        image: (72, nd, nz) the image part alone.
    """

    loss: Array32
    residual_m: Array32
    index: tuple[int, ...]
    weight: Array32
    image: Array32


def sequence_volume(
    model: TargetModel, layers: Sequence[LayerEvidence], turn_rad: float, flip: float, grid: Grid, p: LossParams
) -> SequenceVolume:
    """Evaluate one sequence.

    Args:
        model: The target.
        layers: The sequence's layers that count; at least one.
        turn_rad: Yaw of this sequence minus yaw of the first.
        flip: -1 if this hand points the other way, so that a shift along the first x_P is backwards here; else 1.
        grid: What to try.
        p: Weights.
    """
    yaws = len(model.phi_rad)
    roll = turn_rad / (2 * np.pi) * yaws
    residual = np.stack(
        [np.float32(e.width_m) - _predicted(model, e, roll, flip, grid) for e in layers]
    )  # (H, 72, nd, nz)
    weight = np.array([e.weight for e in layers], dtype=np.float32)
    upper = np.array([e.upper_only for e in layers])
    ok = np.isfinite(residual)
    w = np.where(ok, weight[:, None, None, None], np.float32(0))
    total = w.sum(axis=0)
    covered = total / weight.sum()
    r = np.where(ok, residual, np.float32(0)) / np.float32(p.unit_m)
    bias = (grid.bias_m / p.unit_m).astype(np.float32)
    absolute = np.stack([_one_sided(np.asarray(r - b, dtype=np.float32), upper) for b in bias], axis=1)
    loss = np.float32(p.w_absolute) * _huber_rms(absolute, w[:, None], p.huber)
    if len(layers) > 1:
        mean = (r * w).sum(axis=0) / np.maximum(total, 1e-6)
        both = np.asarray(w * np.where(upper, 0, 1)[:, None, None, None], dtype=np.float32)
        shape = np.float32(p.w_centred) * _huber_rms(np.asarray(r - mean, dtype=np.float32), both, p.huber)
        pairs = np.asarray(np.minimum(both[1:], both[:-1]), dtype=np.float32)
        steps = np.asarray(r[1:] - r[:-1], dtype=np.float32)
        shape += np.float32(p.w_vertical) * _huber_rms(steps, pairs, p.huber)
        loss = loss + shape
    loss = np.where(total > 0, loss, np.float32(NOTHING_FITS)) + np.float32(p.coverage) * (1 - covered)
    image = np.zeros(loss.shape[1:], dtype=np.float32)
    if p.image > 0:
        image = _image_loss(model, layers, roll, flip, grid, p)
        loss = loss + np.float32(p.image) * image
    return SequenceVolume(loss.astype(np.float32), residual, tuple(e.index for e in layers), weight, image)


def _one_sided(r: Array32, upper: Mask) -> Array32:
    """A layer only one pad felt bounds the width from above: predicted widths below the measured one cost nothing."""
    mask = upper[:, None, None, None]
    return np.asarray(np.where(mask, np.minimum(r, np.float32(0)), r), dtype=np.float32)


def _huber_rms(r: Array32, w: Array32, c: float) -> Array32:
    """Weighted Huber RMS over axis 0: sqrt(sum w rho / sum w), rho = r^2 inside c, 2 c |r| - c^2 outside."""
    a = np.abs(r)
    rho = np.where(a <= c, a * a, np.float32(2 * c) * a - np.float32(c * c))
    return np.asarray(np.sqrt((rho * w).sum(axis=0) / np.maximum(w.sum(axis=0), np.float32(1e-6))))


def cross_loss(residuals: Sequence[Array32], volumes: Sequence[SequenceVolume], p: LossParams) -> Array32 | float:
    """H_x: differences between sequences at the same layer. `residuals` (H_k, ...) share trailing axes."""
    terms, weights = [], []
    for k in range(1, len(volumes)):
        for j in range(k):
            for a, index in enumerate(volumes[k].index):
                if index in volumes[j].index:
                    b = volumes[j].index.index(index)
                    d = (residuals[k][a] - residuals[j][b]) / np.float32(p.unit_m)
                    ok = np.isfinite(d)
                    terms.append(np.where(ok, d, np.float32(0)))
                    weights.append(np.where(ok, min(volumes[k].weight[a], volumes[j].weight[b]), np.float32(0)))
    if not terms:
        return 0.0
    return _huber_rms(np.stack(terms), np.stack(weights).astype(np.float32), p.huber)


def _predicted(model: TargetModel, e: LayerEvidence, roll: float, flip: float, grid: Grid) -> Array32:
    """(72, nd, nz) predicted width by linear interpolation in shift, height and yaw."""
    i, f, inside_l = _positions(model.l_m, (e.along_m + flip * grid.shift_m) / grid.scale)
    j, g, inside_z = _positions(model.z_m, (e.height_m + grid.z0_m) / grid.scale)
    t = model.width_m
    low, high = t[:, i], t[:, i + 1]
    f = np.asarray(f[None, :, None])
    a = low[:, :, j] * (1 - f) + high[:, :, j] * f
    b = low[:, :, j + 1] * (1 - f) + high[:, :, j + 1] * f
    out = np.asarray((a * (1 - g) + b * g) * np.float32(grid.scale), dtype=np.float32)
    out[:, ~inside_l] = np.nan
    out[:, :, ~inside_z] = np.nan
    whole = int(np.floor(roll))
    part = np.float32(roll - whole)
    first = np.roll(out, -whole, axis=0)
    if part < 1e-3:
        return np.asarray(first, dtype=np.float32)
    return np.asarray((1 - part) * first + part * np.roll(out, -whole - 1, axis=0), dtype=np.float32)


def _positions(axis: Array, x: Array) -> tuple[Index, Array32, Mask]:
    t = (x - axis[0]) / (axis[1] - axis[0])
    inside = (t >= 0) & (t <= len(axis) - 1)
    i = np.clip(np.floor(t).astype(np.int64), 0, len(axis) - 2)
    return i, np.clip(t - i, 0, 1).astype(np.float32), inside


def _image_loss(
    model: TargetModel, layers: Sequence[LayerEvidence], roll: float, flip: float, grid: Grid, p: LossParams
) -> Array32:
    """(72, nd, nz) robust distance of pad images to the table, averaged over images: cap (1 - exp(-d^2 / cap sd^2))."""
    yaws = len(model.phi_rad)
    table = model.images
    total = np.zeros((yaws, len(grid.shift_m), len(grid.z0_m)), dtype=np.float32)
    count = 0.0
    rows = np.arange(yaws) + round(roll)
    for e in layers:
        l = (e.along_m + flip * grid.shift_m) / grid.scale
        z = (e.height_m + grid.z0_m) / grid.scale
        iz = _nearest(model.z_m, z)
        for side, image in enumerate(e.images):
            if image is None:
                continue
            m = image.astype(np.float32)
            il = _nearest(model.l_m, l if side == 0 else -l)
            phi = (rows + (0 if side == 0 else yaws // 2)) % yaws
            if side == 1:  # the right pad sees the object from behind: its columns run the other way
                m = m.reshape(POOLED)[:, ::-1].reshape(-1)
            f = table[phi[:, None, None], il[None, :, None], iz[None, None, :]]
            d = f - m
            squared = np.einsum("...i,...i->...", d, d) / np.float32(len(m) * p.image_sd**2)
            total += np.float32(p.image_cap * e.weight) * (1 - np.exp(-squared / np.float32(p.image_cap)))
            count += e.weight
    return total / np.float32(count) if count else total


def _nearest(axis: Array, x: Array) -> Index:
    return np.asarray(np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0])).astype(np.int64), 0, len(axis) - 1))
