"""Log ratios target : background of one sequence over the grid of nuisance poses.

Axes: (bias, yaw, shift, height offset). Yaw i is the relative yaw phi_i of the FIRST sequence's hand; the other hands
follow from their known yaws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.recognition.evidence import LayerEvidence
from glotouch_bt.perception.recognition.likelihood.background import image_kernel
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.model import POOLED, Array32, TargetModel, span
from glotouch_bt.robot import Array

Index = npt.NDArray[np.int64]
Floats = npt.NDArray[np.floating]
T_PEAK = 2 / (math.pi * math.sqrt(3))
"""Density of Student's t with three degrees of freedom at 0."""


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
    """Width of one layer at every pose, each (72, nd, nz).

    Attributes:
        off_m: Measured minus predicted width.
        scale_m: Scale of its noise.
        known: Probability that the model predicts it.
    """

    off_m: Floats
    scale_m: Floats
    known: Floats


def width_kernel(z: Floats) -> Floats:
    """Return Student's t with three degrees of freedom, normalised to 1 at its peak."""
    return np.asarray((1 + z * z * np.float32(1 / 3)) ** -2)


def width_ratios(
    model: TargetModel, seen: Sequence[Observed], turn_rad: float, grid: Grid, p: LikelihoodParams
) -> tuple[Array32, Array32, list[WidthVolumes]]:
    """Return log ratios (nb, 72, nd, nz) summed over layers, those of a twin (1, 72, nd, nz), and each layer's volumes.

    The twin differs from the target at each closure independently with probability `twin_width`. A width that the model
    does not know is as that of any object (`Certainty`).
    """
    shape = (len(model.phi_rad), len(grid.shift_m), len(grid.z0_m))
    total, twin = np.zeros((len(grid.bias_m), *shape), dtype=np.float32), np.zeros((1, *shape), dtype=np.float32)
    bias = grid.bias_m.astype(np.float32)[:, None, None, None]
    volumes: list[WidthVolumes] = []
    outlier = np.float32(p.width_outlier)
    far_sd: Floats = np.full((1, 1, 1, 1), p.twin_width_sd_m, dtype=np.float32)
    known: Floats = np.ones((1, 1, 1, 1), dtype=np.float32)
    for o in seen:
        e = o.layer
        at, z_m = e.along_m + grid.shift_m, e.height_m + grid.z0_m
        off = np.float32(e.width_m) - interpolated_width(model, at, z_m, turn_rad)[None]
        sd = np.float32(p.width_rough) * nearest(model.unevenness_m, model, at, z_m, turn_rad)[None]
        sd = np.sqrt(sd * sd + np.float32(p.width_sd_m**2))
        if model.certainty is not None:
            unsure = nearest(model.certainty.width_sd_m, model, at, z_m, turn_rad)[None]
            sd, far_sd = np.hypot(sd, unsure), np.hypot(np.float32(p.twin_width_sd_m), unsure)
            known = nearest(model.certainty.width_known, model, at, z_m, turn_rad)[None]
        volumes.append(WidthVolumes(off[0], sd[0], np.broadcast_to(known[0], shape)))
        scale = (1 - p.width_outlier) * math.exp(-o.log_width)
        if e.upper_only:  # contact of the other finger outside its gel: the width is an upper bound
            far_peak: Floats = np.full((1, 1, 1, 1), np.float32(scale / p.width_range_m))
            peak: Floats = far_peak
            biased = np.minimum(off - bias, np.float32(0))
            off = np.minimum(off, np.float32(0))
        else:
            far_peak = np.float32(scale * T_PEAK) / far_sd
            peak = np.float32(scale * T_PEAK) / sd
            biased = off - bias
        # An empty window (NaN) predicts no contact; only the outlier density remains.
        missed = outlier + (1 - known) * (1 - outlier)
        total += np.log(_or_none(known * width_kernel(biased / sd) * peak) + missed)
        near, far = width_kernel(off / sd) * peak, width_kernel(off / far_sd) * far_peak
        twin += np.log(_or_none(known * (near + np.float32(p.twin_width) * (far - near))) + missed)
    return total, twin, volumes


def _or_none(density: Floats) -> Floats:
    return np.where(np.isnan(density), np.float32(0), density)


def image_ratios(
    model: TargetModel, seen: Sequence[Observed], turn_rad: float, grid: Grid, p: LikelihoodParams
) -> Array32:
    """Return log ratios (72, nd, nz) of image densities, pose : background, summed over the images."""
    yaws = len(model.phi_rad)
    total = np.zeros((len(grid.z0_m), len(grid.shift_m), yaws), dtype=np.float32)
    turn = round(turn_rad / (2 * np.pi) * yaws)
    for o in seen:
        e = o.layer
        z_m = e.height_m + grid.z0_m
        for side, image in enumerate(e.images):
            if image is None:
                continue
            m = image.astype(np.float32)
            at = e.along_m + grid.shift_m
            roll = turn
            if side == 1:  # the right pad views the opposite side: its columns are reversed
                m = np.ascontiguousarray(m.reshape(POOLED)[:, ::-1]).reshape(-1)
                at, roll = -at, turn + yaws // 2
            squared = _squared_distance(model, m, at, z_m)
            # (kernel / background) (1 - outlier) + outlier
            good: Floats = np.full((1, 1, 1), (1 - p.image_outlier) * math.exp(-o.log_images[side]), dtype=np.float32)
            missed: Floats = np.full((1, 1, 1), p.image_outlier, dtype=np.float32)
            if model.certainty is not None:
                known = nearest(model.certainty.image_known, model, at, z_m, 0.0).transpose(2, 1, 0)
                good, missed = good * known, missed + (1 - known) * (1 - missed)
            ratio = np.log(image_kernel(squared, p) * good + missed)
            roll %= yaws
            total[:, :, : yaws - roll] += ratio[:, :, roll:]
            total[:, :, yaws - roll :] += ratio[:, :, :roll]
    return np.ascontiguousarray(total.transpose(2, 1, 0))


def _squared_distance(model: TargetModel, feature: Array32, l_m: Array, z_m: Array) -> Array32:
    """Return mean squared distances (nz, nd, 72) of a feature (35,) to the table, interpolated between cells."""
    i, f = _positions(model.l_m, l_m)
    j, g = _positions(model.z_m, z_m)
    a, b = int(i.min()), int(i.max()) + 2
    c, d = int(j.min()), int(j.max()) + 2
    squared = model.image_norms[c:d, a:b] - 2 * (model.images_by_height[c:d, a:b] @ feature) + feature @ feature
    squared = np.maximum(squared, 0) * np.float32(1 / feature.size)
    f, g = f[None, :, None], g[:, None, None]
    along = squared[:, i - a]
    along += f * (squared[:, i - a + 1] - along)
    out = along[j - c]
    out += g * (along[j - c + 1] - out)
    return np.asarray(out)


def interpolated_width(model: TargetModel, l_m: Array, z_m: Array, turn_rad: float) -> Array32:
    """Return predicted widths (72, nl, nz) at yaws phi + turn; NaN for empty windows and outside the table."""
    i, f = _positions(model.l_m, l_m)
    j, g = _positions(model.z_m, z_m)
    a, b = int(i.min()), int(i.max()) + 2
    c, d = int(j.min()), int(j.max()) + 2
    t = model.width_m[:, a:b, c:d]
    i, j = i - a, j - c
    along = t[:, i] * (1 - f)[None, :, None] + t[:, i + 1] * f[None, :, None]
    out = along[:, :, j] * (1 - g) + along[:, :, j + 1] * g
    out[:, (l_m < model.l_m[0]) | (l_m > model.l_m[-1])] = np.nan
    out[:, :, (z_m < model.z_m[0] - 5e-3) | (z_m > model.z_m[-1])] = np.nan
    roll = turn_rad / (2 * np.pi) * len(model.phi_rad)
    whole = math.floor(roll + 1e-6)
    part = np.float32(max(roll - whole, 0.0))
    whole %= len(out)
    first = np.concatenate([out[whole:], out[:whole]]) if whole else out
    if part < 1e-3:
        return np.asarray(first, dtype=np.float32)
    return np.asarray((1 - part) * first + part * np.concatenate([first[1:], first[:1]]), dtype=np.float32)


def nearest(table: Array32, model: TargetModel, l_m: Array, z_m: Array, turn_rad: float) -> Array32:
    """Return the values (72, nl, nz) of the nearest cells of a table of a model, at yaws phi + turn."""
    i, j = (
        np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0])), 0, len(axis) - 1).astype(np.int64)
        for axis, x in ((model.l_m, l_m), (model.z_m, z_m))
    )
    turn = round(turn_rad / (2 * np.pi) * len(model.phi_rad))
    return np.roll(table[:, i[:, None], j[None, :]], -turn, axis=0)


def _positions(axis: Array, x: Array) -> tuple[Index, Array32]:
    """Return lower cell and fraction of each x, clamped to the axis."""
    last = len(axis) - 1
    t = np.minimum(np.maximum((x - axis[0]) * (last / (axis[-1] - axis[0])), 0.0), last - 1e-9)
    i = t.astype(np.int64)  # floor, because t is not negative
    return i, (t - i).astype(np.float32)


def log_sum(x: Array32, axis: int | tuple[int, ...]) -> Array32:
    """Return the stable log-sum-exp over axes; -inf if all are."""
    top = x.max(axis=axis, keepdims=True)
    safe = np.where(np.isfinite(top), top, np.float32(0))
    return np.asarray(np.log(np.exp(x - safe).sum(axis=axis)) + np.squeeze(safe, axis=axis), dtype=np.float32)


def marginalise_turn(x: Array32, p: LikelihoodParams, sd_rad: float) -> Array32:
    """Marginalise over the object's turn along axis 1: a normal of `sd_rad`, and a uniform part of weight `slip`."""
    n = x.shape[1]
    step = 2 * math.pi / n
    reach = min(max(1, math.ceil(2 * sd_rad / step)), n // 2)
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / sd_rad) ** 2)
    weight *= (1 - p.slip) / weight.sum()
    top = x.max(axis=1, keepdims=True)
    e = np.exp(x - top)
    wrapped = np.concatenate([e[:, -reach:], e, e[:, :reach]], axis=1)
    out = np.float32(p.slip) * e.mean(axis=1, keepdims=True)
    for k, w in enumerate(weight):
        out = out + np.float32(w) * wrapped[:, k : k + n]
    return np.asarray(np.log(out) + top, dtype=np.float32)


def slide_matrix(grid: Grid, p: LikelihoodParams) -> Array32:
    """Return the probability (nd, nd) of shift i in one sequence, given the common shift j."""
    off = (grid.shift_m[:, None] - grid.shift_m[None, :]) / p.slide_sd_m
    weight = np.exp(-0.5 * off**2)
    weight /= weight.sum(axis=0, keepdims=True)
    return np.asarray((1 - p.slip) * weight + p.slip / len(weight), dtype=np.float32)


def marginalise_slide(x: Array32, slide: Array32) -> Array32:
    """Marginalise over the object's slide along axis 2 of (nb, 72, nd, nz)."""
    top = x.max(axis=2, keepdims=True)
    mixed = np.einsum("byiz,ij->byjz", np.exp(x - top), slide)
    return np.asarray(np.log(mixed) + top, dtype=np.float32)
