"""Where the target lies, from the width fit: the hand's own middle, corrected by what each pad felt."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from glotouch_bt.recognition.decision import Fit
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.recognition.paper.branches import BranchFit, WidthFit
from glotouch_bt.recognition.paper.observation import Observation, SequenceReading
from glotouch_bt.recognition.paper.params import PaperParams
from glotouch_bt.recognition.paper.widths import WidthTable, width_tables
from glotouch_bt.recognition.raster import hand_axes
from glotouch_bt.robot import Array


def pose_of_fit(
    model: TargetModel, seen: Observation, widths: WidthFit, centre_K_m: Array, p: PaperParams
) -> tuple[Fit, tuple[float, float, float]]:
    """Fit and (x, y, yaw) of the mesh's frame O in K.

    Of the coupled branch if the sequences are likelier coupled than not, else of the sequence that fits best. Along x_P
    the fitted shift tells the place; along y_P the jaws hold the object with its two supports about their middle.
    """
    if seen.p_coupled >= 0.5:
        best, readings = widths.coupled, seen.sequences
    else:
        k = int(np.argmin([f.loss for f in widths.independent]))
        best, readings = widths.independent[k], seen.sequences[k : k + 1]
    phi = best.yaw_index * 2 * math.pi / len(model.phi_rad)
    yaw = math.remainder(readings[0].yaw_rad - phi, 2 * math.pi)
    x_K, y_K = hand_axes(np.asarray(readings[0].yaw_rad))
    table = width_tables(model, p.scales)[p.scales.index(best.scale)]
    middle_K = centre_K_m - best.shift_m * x_K + _across(table, readings, best) * y_K
    c, s = math.cos(yaw), math.sin(yaw)
    origin = middle_K - np.array([[c, -s], [s, c]]) @ (best.scale * model.centre_m)
    reflected = abs(math.remainder(phi, 2 * math.pi)) > math.pi / 2
    fit = Fit(yaw, best.shift_m, best.z0_m, best.scale, best.bias_m, reflected)
    return fit, (float(origin[0]), float(origin[1]), yaw)


def _across(table: WidthTable, readings: Sequence[SequenceReading], best: BranchFit) -> float:
    """Mean, over two-sided layers, of where along y_P the footprint's middle must be; 0 without any."""
    found: list[float] = []
    for r in readings:
        j = round((r.along_m + best.shift_m - table.l_m[0]) / (table.l_m[1] - table.l_m[0]))
        for height, across, both in zip(r.height_m, r.across_m, r.bilateral, strict=True):
            k = round((height + best.z0_m - table.z_m[0]) / (table.z_m[1] - table.z_m[0]))
            if both and 0 <= j < len(table.l_m) and 0 <= k < len(table.z_m):
                found.append(float(across) - float(table.middle_m[best.yaw_index, j, k]))
    finite = [x for x in found if math.isfinite(x)]
    return float(np.mean(finite)) if finite else 0.0
