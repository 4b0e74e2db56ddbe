"""Pose of the target in K from the best fit."""

from __future__ import annotations

import math

import numpy as np

from glotouch_bt.perception.recognition.decision import Fit
from glotouch_bt.perception.recognition.evidence import Evidence
from glotouch_bt.perception.recognition.model import TargetModel, hand_axes
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import Array

CENTRE_SD_M = 4e-3
"""Standard deviation of the contour's centre."""
ALONG_SD_M = 2.5e-3
"""Standard deviation of the fitted shift along x_P."""
ACROSS_SD_M = 1e-3
"""Standard deviation of the position along y_P, where the jaws centre the object."""
SEQUENCE_DISCOUNT = 0.5
"""Weight of a sequence relative to the next one: squeezes move the object."""


def contour_pose(touchset: TouchSet) -> tuple[float, float, float]:
    """Return the contour's pose (x, y, yaw) in K, used without contact evidence."""
    c = touchset.candidate.contour
    return float(c.centre_K_m[0]), float(c.centre_K_m[1]), float(c.yaw_rad)


def fitted_pose(
    model: TargetModel,
    touchset: TouchSet,
    e: Evidence,
    yaw_index: float,
    shift_m: Array,
    z0_m: float,
    scale: float,
    bias_m: float,
) -> tuple[Fit, tuple[float, float, float]]:
    """Return Fit and pose_K_O (x, y, yaw) by weighted least squares over the layers.

    Each layer gives the position along x_P (fitted shift) and, more precisely, along y_P: the jaws centre the point
    halfway between the two supports, corrected for unequal indentations.

    Args:
        model: The target.
        touchset: Touches of the candidate.
        e: Their evidence.
        yaw_index: Best relative yaw of the first sequence, in table steps (fractional).
        shift_m: (K,) best shift of each sequence.
        z0_m: Best height offset.
        scale: Best scale.
        bias_m: Best aperture bias.
    """
    step = 2 * np.pi / len(model.phi_rad)
    first = float(e.yaw_rad[min(layer.sequence for layer in e.layers)])
    phi0 = yaw_index * step
    theta = math.remainder(first - phi0, 2 * math.pi)
    centre = np.asarray(touchset.candidate.contour.centre_K_m, dtype=np.float64)
    last = max(layer.sequence for layer in e.layers)
    normal = np.eye(2) / CENTRE_SD_M**2
    right = centre / CENTRE_SD_M**2
    z_step = model.z_m[1] - model.z_m[0]
    l_step = model.l_m[1] - model.l_m[0]
    for layer in e.layers:
        raw = touchset.sequences[layer.sequence].layers[layer.index]
        x, y = hand_axes(np.asarray(raw.yaw_rad))
        age = SEQUENCE_DISCOUNT ** (last - layer.sequence) * layer.weight
        along = layer.along_m + float(shift_m[layer.sequence])
        w = age / ALONG_SD_M**2
        normal += w * np.outer(x, x)
        right += w * x * (x @ centre - float(shift_m[layer.sequence]))
        i = round((phi0 + raw.yaw_rad - first) / step) % len(model.phi_rad)
        j = round((along / scale - model.l_m[0]) / l_step)
        k = round(((layer.height_m + z0_m) / scale - model.z_m[0]) / z_step)
        if not (0 <= j < len(model.l_m) and 0 <= k < len(model.z_m)) or layer.upper_only:
            continue
        middle = scale * float(model.middle_m[i, j, k])
        if math.isfinite(middle):
            w = age / ACROSS_SD_M**2
            place = y @ np.asarray(raw.position_K_m) - middle + 0.5 * (layer.sunk_m[0] - layer.sunk_m[1])
            normal += w * np.outer(y, y)
            right += w * y * place
    middle_K = np.linalg.solve(normal, right)
    c, s = math.cos(theta), math.sin(theta)
    origin = middle_K - np.array([[c, -s], [s, c]]) @ (scale * model.centre_m)
    fit = Fit(theta, float(shift_m[last]), z0_m, scale, bias_m)
    return fit, (float(origin[0]), float(origin[1]), theta)
