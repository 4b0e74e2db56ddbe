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
    """Width of one layer at every pose, each (72, nd, nz).

    Attributes:
        off_m: Measured minus predicted width; -inf where the window is empty.
        scale_m: Scale of its noise.
        known: Probability that the model predicts it.
        unsure_m: The part of the scale that is the model's.
    """

    off_m: Floats
    scale_m: Floats
    known: Floats
    unsure_m: Floats | None = None


def width_kernel(z: Floats) -> Floats:
    """Return Student's t with three degrees of freedom, normalised to 1 at its peak."""
    near = 1 + z * z * np.float32(1 / 3)
    return np.asarray(1 / (near * near))


def width_ratios(
    model: TargetModel, seen: Sequence[Observed], turn_rad: float, grid: Grid, p: LikelihoodParams
) -> tuple[Array32, list[WidthVolumes]]:
    """Return log ratios (nb, 72, nd, nz) of widths, summed over layers, and each layer's volumes.

    A width that the model does not know is as that of any object (`Certainty`).
    """
    shape = (len(model.phi_rad), len(grid.shift_m), len(grid.z0_m))
    total = np.zeros((len(grid.bias_m), *shape[::-1]), dtype=np.float32)
    bias = grid.bias_m.astype(np.float32)[:, None, None, None]
    volumes: list[WidthVolumes] = []
    product: Floats = np.ones_like(total)
    for n, o in enumerate(seen, 1):
        e = o.layer
        at, z_m = e.along_m + grid.shift_m, e.height_m + grid.z0_m
        off = np.float32(e.width_m) - interpolated_width(model, at, z_m, turn_rad)
        off[np.isnan(off)] = -np.inf
        sd = np.float32(p.width_rough) * nearest(model.unevenness_m, model, at, z_m, turn_rad)
        sd = np.sqrt(sd * sd + np.float32(p.width_sd_m**2))
        known: Floats = np.broadcast_to(np.float32(1), shape)
        unsure: Floats | None = None
        if model.certainty is not None:
            unsure = nearest(model.certainty.width_sd_m, model, at, z_m, turn_rad)
            sd = np.hypot(sd, unsure)
            known = nearest(model.certainty.width_known, model, at, z_m, turn_rad)
        volumes.append(WidthVolumes(off, sd, known, unsure))
        peak, missed = known * _peak(o, sd, p), _missed(known, p)
        near = off.transpose(2, 1, 0) - bias  # all in (nb, nz, nd, 72), the order in memory, and in place
        if e.upper_only:
            np.minimum(near, np.float32(0), out=near)
        near /= sd.transpose(2, 1, 0)
        near *= near
        near *= np.float32(1 / 3)
        near += np.float32(1)
        near *= near
        np.divide(peak.transpose(2, 1, 0), near, out=near)
        near += missed.transpose(2, 1, 0)
        product *= near
        if n % LAYERS_A_LOG == 0 or n == len(seen):
            total += np.log(product)
            product = np.ones_like(total)
    return total.transpose(0, 3, 2, 1), volumes


def twin_ratios(volumes: Sequence[WidthVolumes], seen: Sequence[Observed], p: LikelihoodParams) -> Array32:
    """Return log ratios (1, 72, nd, nz) of the widths of a twin, summed over layers.

    The twin differs from the target at each closure independently with probability `twin_width`.
    """
    total = np.zeros((1, *volumes[0].off_m.shape), dtype=np.float32)
    for v, o in zip(volumes, seen, strict=True):
        far_sd: Floats = np.asarray(p.twin_width_sd_m, dtype=np.float32)
        if v.unsure_m is not None:
            far_sd = np.hypot(far_sd, v.unsure_m)
        off = np.minimum(v.off_m, np.float32(0)) if o.layer.upper_only else v.off_m
        near = width_kernel(off / v.scale_m) * _peak(o, v.scale_m, p)
        far = width_kernel(off / far_sd) * _peak(o, far_sd, p)
        total += np.log(v.known * (near + np.float32(p.twin_width) * (far - near)) + _missed(v.known, p))
    return total


def _peak(o: Observed, sd_m: Floats, p: LikelihoodParams) -> Floats:
    """Return the largest density of a width that is no outlier, over that of the background.

    If the other finger touched outside its gel, the width is only an upper bound, and uniform above the object's own.
    """
    scale = (1 - p.width_outlier) * math.exp(-o.log_width)
    if o.layer.upper_only:
        return np.asarray(scale / p.width_range_m, dtype=np.float32)
    return np.float32(scale * T_PEAK) / sd_m


def _missed(known: Floats, p: LikelihoodParams) -> Floats:
    """Return the density of a width that is an outlier or unknown to the model, over that of the background."""
    outlier = np.float32(p.width_outlier)
    return outlier + (1 - known) * (1 - outlier)


def image_ratios(
    model: TargetModel, sequences: Sequence[Sequence[Observed]], turns_rad: Sequence[float], grid: Grid,
    p: LikelihoodParams,
) -> list[Array32]:  # fmt: skip
    """Return each sequence's log ratios (72, nd, nz) of image densities, pose : background, summed over its images.

    Images at heights between the same cells of the table are compared with these cells at once.
    """
    yaws = len(model.phi_rad)
    totals = [np.zeros((len(grid.z0_m), len(grid.shift_m), yaws), dtype=np.float32) for _ in sequences]
    by_cells: dict[tuple[int, ...], list[_View]] = {}
    for total, seen, turn_rad in zip(totals, sequences, turns_rad, strict=True):
        turn = round(turn_rad / (2 * np.pi) * yaws)
        for o in seen:
            z_m = o.layer.height_m + grid.z0_m
            cells = tuple(_positions(model.z_m, z_m)[0].tolist())
            for side, image in enumerate(o.layer.images):
                if image is None:
                    continue
                feature = image.astype(np.float32)
                at, roll = o.layer.along_m + grid.shift_m, turn
                if side == 1:  # the right pad views the opposite side: its columns are reversed
                    feature = feature.reshape(POOLED)[:, ::-1].reshape(-1)
                    at, roll = -at, turn + yaws // 2
                view = _View(feature, at, z_m, roll % yaws, o.log_images[side], total)
                by_cells.setdefault(cells, []).append(view)
    for views in by_cells.values():
        for v, squared in zip(views, _squared_distances(model, views), strict=True):
            # (kernel / background) (1 - outlier) + outlier
            good: Floats = np.asarray((1 - p.image_outlier) * math.exp(-v.log_image), dtype=np.float32)
            missed: Floats = np.asarray(p.image_outlier, dtype=np.float32)
            if model.certainty is not None:
                known = nearest(model.certainty.image_known, model, v.l_m, v.z_m, 0.0).transpose(2, 1, 0)
                good, missed = good * known, missed + (1 - known) * (1 - missed)
            ratio = np.log(image_kernel(squared, p) * good + missed)
            v.total[:, :, : yaws - v.roll] += ratio[:, :, v.roll :]
            v.total[:, :, yaws - v.roll :] += ratio[:, :, : v.roll]
    return [total.transpose(2, 1, 0) for total in totals]


@dataclass(frozen=True, eq=False)
class _View:
    """One pad's image, as the left pad would have felt it.

    Attributes:
        feature: (35,) feature.
        l_m, z_m: (nd,) and (nz,) places of the pad's middle.
        roll: Its yaw from the first sequence's hand, in table steps.
        log_image: Background log density.
        total: (nz, nd, 72) sum of its sequence.
    """

    feature: Array32
    l_m: Array
    z_m: Array
    roll: int
    log_image: float
    total: Array32


def _squared_distances(model: TargetModel, views: Sequence[_View]) -> list[Array32]:
    """Return mean squared distances (nz, nd, 72) of each feature to the table, interpolated between cells.

    All views lie between the same heights of the table.
    """
    i, f = _positions(model.l_m, np.array([v.l_m for v in views]))
    j, g = _positions(model.z_m, np.array([v.z_m for v in views]))
    features = np.array([v.feature for v in views])
    a, b = int(i.min()), int(i.max()) + 2
    c, d = int(j.min()), int(j.max()) + 2
    table = model.images_by_height[c:d, a:b]
    norms = model.image_norms[c:d, a:b].reshape(d - c, 1, -1)
    squared = features @ table.reshape(d - c, -1, features.shape[1]).transpose(0, 2, 1)  # (heights, n, places)
    squared *= np.float32(-2)
    squared += norms
    squared += (features**2).sum(axis=1)[:, None]
    np.maximum(squared, np.float32(0), out=squared)
    squared *= np.float32(1 / features.shape[1])
    squared = squared.reshape(d - c, len(views), b - a, -1).transpose(1, 0, 2, 3)
    out = []
    for k, one in enumerate(squared):
        along = one[:, i[k] - a]
        along += f[k][None, :, None] * (one[:, i[k] - a + 1] - along)
        low = along[j[k] - c]
        low += g[k][:, None, None] * (along[j[k] - c + 1] - low)
        out.append(low)
    return out


def interpolated_width(model: TargetModel, l_m: Array, z_m: Array, turn_rad: float) -> Array32:
    """Return predicted widths (72, nl, nz) at yaws phi + turn; NaN for empty windows and outside the table."""
    i, f = _positions(model.l_m, l_m)
    j, g = _positions(model.z_m, z_m)
    c, d = int(j.min()), int(j.max()) + 2
    t = model.width_m.transpose(2, 1, 0)[c:d]  # (heights, shifts, yaws)
    j, f, g = j - c, f[None, :, None], g[:, None, None]
    along = t[:, i] * (1 - f) + t[:, i + 1] * f
    out = along[j] * (1 - g) + along[j + 1] * g
    out[:, (l_m < model.l_m[0]) | (l_m > model.l_m[-1])] = np.nan
    out[(z_m < model.z_m[0] - 5e-3) | (z_m > model.z_m[-1])] = np.nan
    roll = turn_rad / (2 * np.pi) * len(model.phi_rad)
    whole = math.floor(roll + 1e-6)
    part = np.float32(max(roll - whole, 0.0))
    first = _turned(out, whole)
    if part >= 1e-3:
        first = (1 - part) * first + part * _turned(first, 1)
    return np.asarray(first.transpose(2, 1, 0), dtype=np.float32)


def nearest(table: Array32, model: TargetModel, l_m: Array, z_m: Array, turn_rad: float) -> Array32:
    """Return the values (72, nl, nz) of the nearest cells of a table of a model, at yaws phi + turn."""
    i, j = (
        np.clip(np.rint((x - axis[0]) / (axis[1] - axis[0])), 0, len(axis) - 1).astype(np.int64)
        for axis, x in ((model.l_m, l_m), (model.z_m, z_m))
    )
    turn = round(turn_rad / (2 * np.pi) * len(model.phi_rad))
    return _turned(table.transpose(2, 1, 0)[j[:, None], i[None, :]], turn).transpose(2, 1, 0)


def _turned(x: Floats, steps: int) -> Array32:
    """Return an array (..., 72) at yaws that are `steps` larger."""
    at = steps % x.shape[-1]
    return np.asarray(np.concatenate([x[..., at:], x[..., :at]], axis=-1) if at else x, dtype=np.float32)


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
    mixed = (slide.T @ np.exp(x - top).transpose(0, 3, 2, 1)).transpose(0, 3, 2, 1)
    return np.asarray(np.log(mixed) + top, dtype=np.float32)
