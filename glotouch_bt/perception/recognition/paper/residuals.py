"""Residual families of eq. (width_sensor_loss) per sequence, as sums shared by both branches.

The weighted Huber RMS is sqrt(sum w rho(r) / sum w), rho(r) = r^2 for |r| <= c and 2 c |r| - c^2 beyond: the plain RMS
for small residuals. The coupled branch adds the sums of all sequences; the independent branch uses them separately.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from glotouch_bt.perception.recognition.model import Array32
from glotouch_bt.perception.recognition.paper.observation import SequenceReading
from glotouch_bt.perception.recognition.paper.params import PaperParams
from glotouch_bt.robot import Array


def huber(r: Array32, c: float) -> Array32:
    """Compute rho(r) elementwise: r^2 within c, 2 c |r| - c^2 beyond."""
    a = np.abs(r)
    m = np.minimum(a, np.float32(c))
    return np.asarray(m * (2 * a - m), dtype=np.float32)


def rms(numerator: Array32, denominator: Array32) -> Array32:
    """Compute sqrt(numerator / denominator), 0 for an empty sum."""
    return np.sqrt(numerator / np.maximum(denominator, np.float32(1e-9)))


@dataclass(frozen=True)
class Sums:
    """Numerators and denominators over one or more sequences.

    Attributes:
        absolute: (B, N) for each aperture bias.
        weight: (N,) evidence of the layers with support, the denominator of `absolute` and `centred`.
        centred: (N,).
        vertical, vertical_weight: (N,).
        cross, cross_weight: (N,) or 0.
        supported, taken: (N,) number of layers with finite predicted support, and of all layers.
    """

    absolute: Array32
    weight: Array32
    centred: Array32
    vertical: Array32
    vertical_weight: Array32
    cross: Array32 | float
    cross_weight: Array32 | float
    supported: Array32
    taken: int

    def loss(self, bias_m: Array, p: PaperParams) -> Array32:
        """Compute G of eq. (width_sensor_loss), (B, N); infinite if no layer has support."""
        shape = np.float32(p.w_centred) * rms(self.centred, self.weight)
        shape = shape + np.float32(p.w_vertical) * rms(self.vertical, self.vertical_weight)
        if p.w_cross > 0 and not isinstance(self.cross, float):
            shape = shape + np.float32(p.w_cross) * rms(self.cross, np.asarray(self.cross_weight, dtype=np.float32))
        shape = shape + np.float32(p.coverage) * (1 - self.supported / np.float32(self.taken))
        shape = np.where(self.supported > 0, shape, np.float32(np.inf))
        penalty = (p.bias * np.abs(bias_m) / p.bias_unit_m).astype(np.float32)
        return np.float32(p.w_absolute) * rms(self.absolute, self.weight) + shape + penalty[:, None]


def residual_units(reading: SequenceReading, predicted_m: Array32, p: PaperParams) -> Array32:
    """Return measured opening minus predicted width (H, N), in units, without bias; NaN without support."""
    r = np.float32(1.0) * reading.opening_m.astype(np.float32)[:, None] - predicted_m
    return np.asarray(r * np.float32(1 / p.unit_m), dtype=np.float32)


def sequence_sums(r: Array32, weight: Array, bias_m: Array, p: PaperParams) -> Sums:
    """Compute the sums of one sequence.

    Args:
        r: (H, N) residuals in units, lowest layer first; NaN without support.
        weight: (H,) evidence.
        bias_m: (B,) aperture biases.
        p: Weights.
    """
    ok = np.isfinite(r)
    all_there = bool(ok.all())
    r = r if all_there else np.where(ok, r, np.float32(0))
    w1 = weight.astype(np.float32)
    w = np.broadcast_to(w1[:, None], r.shape) if all_there else ok * w1[:, None]
    total = w.sum(axis=0)
    absolute = np.zeros((len(bias_m), r.shape[1]), dtype=np.float32)
    if p.w_absolute > 0:
        for n, b in enumerate(bias_m):
            absolute[n] = np.einsum("hn,hn->n", w, huber(r - np.float32(b / p.unit_m), p.huber))
    centred, vertical, vertical_weight = (np.zeros_like(total) for _ in range(3))
    if len(r) > 1:
        mean = np.einsum("hn,hn->n", w, r) / np.maximum(total, np.float32(1e-9))
        centred = np.einsum("hn,hn->n", w, huber(r - mean, p.huber))
        pair = np.minimum(w[1:], w[:-1])
        vertical = np.einsum("hn,hn->n", pair, huber(r[1:] - r[:-1], p.huber))
        vertical_weight = pair.sum(axis=0)
    return Sums(absolute, total, centred, vertical, vertical_weight, 0.0, 0.0, ok.sum(axis=0, dtype=np.float32), len(r))


def joined(sums: Sequence[Sums], cross: tuple[Array32, Array32] | None) -> Sums:
    """Add the sums of all sequences at one shared pose, with the cross-action sums."""

    def add(name: str) -> Array32:
        return np.asarray(sum(getattr(s, name) for s in sums), dtype=np.float32)

    numerator, denominator = cross or (0.0, 0.0)
    return Sums(
        add("absolute"), add("weight"), add("centred"), add("vertical"), add("vertical_weight"), numerator, denominator,
        add("supported"), sum(s.taken for s in sums),
    )  # fmt: skip


def cross_sums(
    readings: Sequence[SequenceReading], residuals: Sequence[Array32], p: PaperParams
) -> tuple[Array32, Array32] | None:
    """Compute the sums of Delta_a between neighbours along a_k at equal heights; None without comparable layers."""
    order = sorted(range(len(readings)), key=lambda k: readings[k].along_m)
    numerator: Array32 | None = None
    denominator: Array32 | None = None
    for k, m in pairwise(order):
        a, b = readings[k], readings[m]
        gap = np.abs(a.height_m[:, None] - b.height_m[None, :])
        for i in range(len(a.height_m)):
            j = int(np.argmin(gap[i]))
            if gap[i, j] > p.pair_gap_m:
                continue
            d = residuals[m][j] - residuals[k][i]
            ok = np.isfinite(d)
            w = np.float32(min(a.weight[i], b.weight[j])) * ok
            n = w * huber(np.where(ok, d, np.float32(0)), p.huber)
            numerator = n if numerator is None else numerator + n
            denominator = w if denominator is None else denominator + w
    return None if numerator is None or denominator is None else (numerator, denominator)
