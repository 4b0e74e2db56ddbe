"""L_width: minimisation of the coupled and the independent branch, mixed by p_c (eq. soft_action_graph)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.recognition.model import Array32, TargetModel
from glotouch_bt.perception.recognition.paper.observation import PaperObservation, SequenceReading
from glotouch_bt.perception.recognition.paper.params import PaperParams
from glotouch_bt.perception.recognition.paper.residuals import Sums, cross_sums, joined, residual_units, sequence_sums
from glotouch_bt.perception.recognition.paper.widths import Hypotheses, predicted_widths, width_tables
from glotouch_bt.robot import Array

COARSE_BIAS_M = 1e-3
"""Step of the aperture bias for all hypotheses."""
FINE_BIAS_M = 1e-4
"""Step of the aperture bias for the best hypotheses."""
REFINED = 24
"""Number of hypotheses with a refined bias."""
TIE = 1e-3
"""Penalty at the edge of the grid, which resolves a flat loss towards the contour's centre."""


@dataclass(frozen=True)
class BranchFit:
    """Minimum of one branch, or of one sequence of the independent branch.

    Attributes:
        loss: G plus the scale prior.
        yaw_index: Relative yaw in table steps.
        scale, shift_m, z0_m, bias_m: Nuisance parameters at the minimum.
    """

    loss: float
    yaw_index: int
    scale: float
    shift_m: float
    z0_m: float
    bias_m: float


@dataclass(frozen=True)
class WidthFit:
    """Fit of both branches.

    Attributes:
        loss: L_width.
        coupled: Fit of one shared pose.
        independent: One fit per sequence.
    """

    loss: float
    coupled: BranchFit
    independent: tuple[BranchFit, ...]


def fit_widths(model: TargetModel, seen: PaperObservation, p: PaperParams) -> WidthFit:
    """Minimise both branches. Needs at least one sequence."""
    grid = Hypotheses.of(model, p)
    tables = width_tables(model, p.scales)
    readings = seen.sequences
    residuals = [residual_units(s, predicted_widths(tables, s.along_m, s.height_m, grid), p) for s in readings]
    bias = bias_grid(p.bias_limit_m, COARSE_BIAS_M)
    sums = [sequence_sums(r, s.weight, bias, p) for r, s in zip(residuals, readings, strict=True)]
    tie = np.float32(TIE) * grid.off_centre
    strength = p.scale_prior * (1 + p.scale_anisotropy * model.anisotropy)
    prior = np.asarray(strength * np.abs(np.log(grid.scale_of_each)), dtype=np.float32)
    cross = cross_sums(readings, residuals, p) if p.w_cross > 0 else None
    coupled = _min_loss(joined(sums, cross), readings, residuals, prior, tie, grid, p)
    independent = tuple(
        _min_loss(u, [s], [r], prior, tie, grid, p) for u, s, r in zip(sums, readings, residuals, strict=True)
    )
    separate = float(np.median([f.loss for f in independent]))
    share = {"mixed": seen.p_coupled, "coupled": 1.0, "independent": 0.0}[p.branch]
    loss = separate if share == 0 else coupled.loss if share == 1 else share * coupled.loss + (1 - share) * separate
    return WidthFit(loss, coupled, independent)


def bias_grid(limit_m: float, step_m: float) -> Array:
    """Return biases within +-limit, including zero."""
    n = int(np.ceil(limit_m / step_m - 1e-9))
    return np.linspace(-limit_m, limit_m, 2 * n + 1) if n else np.zeros(1)


def _min_loss(
    sums: Sums, readings: Sequence[SequenceReading], residuals: Sequence[Array32], prior: Array32, tie: Array32,
    grid: Hypotheses,     p: PaperParams,
) -> BranchFit:  # fmt: skip
    """Minimise G + prior over coarse biases for all hypotheses, then over fine biases for the best."""
    coarse = sums.loss(bias_grid(p.bias_limit_m, COARSE_BIAS_M), p).min(axis=0) + prior + tie
    n = min(REFINED, coarse.size)
    chosen = np.sort(np.argpartition(coarse, n - 1)[:n])
    bias = bias_grid(p.bias_limit_m, FINE_BIAS_M)
    refined = _taken(sums, readings, residuals, chosen, bias, p).loss(bias, p) + prior[chosen]
    b, i = np.unravel_index(int(np.argmin(refined + tie[chosen])), refined.shape)
    s, yaw, d, z = (int(x) for x in np.unravel_index(int(chosen[i]), grid.shape))
    return BranchFit(
        float(refined[b, i]), yaw, float(grid.scale[s]), float(grid.shift_m[d]), float(grid.z0_m[z]), float(bias[b])
    )


def _taken(
    sums: Sums, readings: Sequence[SequenceReading], residuals: Sequence[Array32], chosen: npt.NDArray[np.intp],
    bias_m: Array, p: PaperParams,
) -> Sums:  # fmt: skip
    """Return the sums at `chosen` hypotheses for other biases, which affect H_a only."""
    only_absolute = p.only("absolute") if p.w_absolute > 0 else p
    fine = [
        sequence_sums(np.asarray(r[:, chosen]), s.weight, bias_m, only_absolute).absolute
        for r, s in zip(residuals, readings, strict=True)
    ]

    def at(a: Array32 | float) -> Array32 | float:
        return a if isinstance(a, float) else a[chosen]

    return replace(
        sums,
        absolute=np.asarray(sum(fine), dtype=np.float32),
        weight=sums.weight[chosen],
        centred=sums.centred[chosen],
        vertical=sums.vertical[chosen],
        vertical_weight=sums.vertical_weight[chosen],
        cross=at(sums.cross),
        cross_weight=at(sums.cross_weight),
        supported=sums.supported[chosen],
    )
