"""Pose of the target: contour centre corrected by the local contact centres (paper IV-C), yaw of the fit."""

from __future__ import annotations

import math

import numpy as np

from glotouch_bt.perception.recognition.decision import Fit
from glotouch_bt.perception.recognition.model import TargetModel, hand_axes
from glotouch_bt.perception.recognition.paper.branches import BranchFit, WidthFit
from glotouch_bt.perception.recognition.paper.observation import PaperObservation, SequenceReading
from glotouch_bt.perception.recognition.paper.params import PaperParams
from glotouch_bt.perception.recognition.paper.widths import WidthTable, width_tables
from glotouch_bt.robot import Array

CENTRE_SD_M = 4e-3
"""Standard deviation of the contour's centre."""
ALONG_SD_M = 8e-3
"""Standard deviation of the fitted window shift."""
ACROSS_SD_M = 1e-3
"""Standard deviation of the position along y_P, where the jaws centre the object."""


def pose_of_fit(
    model: TargetModel, seen: PaperObservation, widths: WidthFit, centre_K_m: Array, p: PaperParams
) -> tuple[Fit, tuple[float, float, float]]:
    """Return Fit and (x, y, yaw) of the mesh's frame O in K; the position by least squares over the sequences.

    If p_c >= 0.5 all sequences use the coupled pose. Otherwise each uses its own, and the yaw is that of the best fit.
    """
    tables = dict(zip(p.scales, width_tables(model, p.scales), strict=True))
    if seen.p_coupled >= 0.5:
        fits = [widths.coupled] * len(seen.sequences)
        frames = [seen.sequences[0].yaw_rad] * len(seen.sequences)
        best = 0
    else:
        fits = list(widths.independent)
        frames = [r.yaw_rad for r in seen.sequences]
        best = int(np.argmin([f.loss for f in fits]))
    normal, right = np.eye(2) / CENTRE_SD_M**2, np.zeros(2)
    for reading, fit, frame in zip(seen.sequences, fits, frames, strict=True):
        x_K, y_K = hand_axes(np.asarray(frame))
        normal += np.outer(x_K, x_K) / ALONG_SD_M**2
        right -= fit.shift_m * x_K / ALONG_SD_M**2
        side = math.copysign(1.0, math.cos(reading.yaw_rad - frame))  # y_P is reversed for a hand turned by 180 deg
        across = _across(tables[fit.scale], reading, fit, side)
        if across is not None:
            normal += np.outer(y_K, y_K) / ACROSS_SD_M**2
            right += across * y_K / ACROSS_SD_M**2
    chosen = fits[best]
    phi = chosen.yaw_index * 2 * math.pi / len(model.phi_rad)
    yaw = math.remainder(frames[best] - phi, 2 * math.pi)
    c, s = math.cos(yaw), math.sin(yaw)
    middle_K = centre_K_m + np.linalg.solve(normal, right)
    origin = middle_K - np.array([[c, -s], [s, c]]) @ (chosen.scale * model.centre_m)
    found = Fit(yaw, chosen.shift_m, chosen.z0_m, chosen.scale, chosen.bias_m)
    return found, (float(origin[0]), float(origin[1]), yaw)


def _across(table: WidthTable, reading: SequenceReading, fit: BranchFit, side: float) -> float | None:
    """Return the footprint's middle along y_P, averaged over two-sided layers; None without any."""
    found: list[float] = []
    j = round((reading.along_m + fit.shift_m - table.l_m[0]) / (table.l_m[1] - table.l_m[0]))
    for height, across, both in zip(reading.height_m, reading.across_m, reading.bilateral, strict=True):
        k = round((height + fit.z0_m - table.z_m[0]) / (table.z_m[1] - table.z_m[0]))
        if both and 0 <= j < len(table.l_m) and 0 <= k < len(table.z_m):
            found.append(side * float(across) - float(table.middle_m[fit.yaw_index, j, k]))
    finite = [x for x in found if math.isfinite(x)]
    return float(np.mean(finite)) if finite else None
