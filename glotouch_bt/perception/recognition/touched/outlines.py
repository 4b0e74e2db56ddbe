"""Predictions from traced outlines: extents across the jaws, and the traces of another encounter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from glotouch_bt.perception.recognition.model import TIP_RADIUS_M, KindFit, Outline, hand_axes, outline_of
from glotouch_bt.perception.touch import Contour, ContourKind, signed_distance
from glotouch_bt.robot import Array

STEP_M = 0.5e-3
"""Distance of the places at which a simulated trace tests the ball for contact, and of points on an outline."""
TRACE_SD_M = 1.5e-3
"""Standard deviation of a traced side: the error of one trace. Source: `LikelihoodParams`."""
OTHER_KIND_SD_M = 3.0e-3
"""The same for a kind as which the object was never traced: its fit is simulated on the other. Source: ours."""


def points_of(contour: Contour) -> Array:
    """Return points (n, 2) along an outline, `STEP_M` apart."""
    corners = contour.outline_K_m(96)
    out = []
    for a, b in pairwise(corners):
        count = max(2, math.ceil(float(np.linalg.norm(b - a)) / STEP_M))
        out.append(a + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (b - a))
    return np.concatenate(out)


def extents_m(contour: Contour, phi_rad: Array, l_m: Array, half_m: float) -> tuple[Array, Array]:
    """Return the (minimum, maximum) coordinate along y_P of an outline, each (yaws, shifts); NaN beside it.

    Args:
        contour: The outline, in O.
        phi_rad: (yaws,) directions of x_P.
        l_m: (shifts,) coordinates of the pads' mid-point along x_P.
        half_m: Half the width of the pads.
    """
    points = points_of(contour)
    x, y = hand_axes(phi_rad)
    along, across = x @ points.T, y @ points.T  # (yaws, points)
    inside = np.abs(along[:, None, :] - l_m[None, :, None]) <= half_m
    some = inside.any(axis=2)
    low = np.where(inside, across[:, None, :], np.inf).min(axis=2)
    high = np.where(inside, across[:, None, :], -np.inf).max(axis=2)
    return np.where(some, low, np.nan), np.where(some, high, np.nan)


def middle_m(contour: Contour, phi_rad: float, along_m: float, half_m: float) -> float:
    """Return the y_P coordinate halfway between the two sides of an outline; NaN beside it."""
    low, high = extents_m(contour, np.array([phi_rad]), np.array([along_m]), half_m)
    return 0.5 * float(low[0, 0] + high[0, 0])


def retraced(contours: Sequence[Contour]) -> Outline:
    """Return the traces to expect in another encounter, with the error of the traces of these encounters.

    Each outline is traced anew in simulation. The probability of a kind counts encounters only, by Laplace's rule.
    """
    simulated = [outline_of(_Tips(c), np.asarray(c.centre_K_m)) for c in contours]
    boxes = sum(c.kind == "box" for c in contours)

    def fit(kind: ContourKind) -> KindFit:
        same_kind = [o.of(kind) for o, c in zip(simulated, contours, strict=True) if c.kind == kind]
        trace_sd = TRACE_SD_M / math.sqrt(len(same_kind)) if same_kind else OTHER_KIND_SD_M
        fits = same_kind or [o.of(kind) for o in simulated]
        first = fits[0]
        size, spread = np.array([f.size_m for f in fits]), np.array([f.size_sd_m for f in fits])
        sd = np.sqrt(size.var(axis=0) + np.square(spread).mean(axis=0) + trace_sd**2)
        mean = np.mean(np.exp(2j * np.array([f.yaw_rad for f in fits])))
        return replace(
            first,
            centre_m=np.mean([f.centre_m for f in fits], axis=0),
            centre_sd_m=math.hypot(max(f.centre_sd_m for f in fits), trace_sd),
            size_m=(float(size[:, 0].mean()), float(size[:, 1].mean())),
            size_sd_m=(float(sd[0]), float(sd[1])),
            fit_sd_m=(0.0, 0.0),  # the outline itself comes from a fit, so that another one errs as much as it states
            yaw_rad=0.5 * float(np.angle(mean)) if kind == "box" else 0.0,
        )

    return Outline(fit("round"), fit("box"), (boxes + 1) / (len(contours) + 2))


class _Tips:
    """Ball centres at the first contact with an outline, as `model.traced_tips` returns them for a solid."""

    def __init__(self, contour: Contour) -> None:
        self._contour = contour

    def __call__(self, aim_m: Array, contacts: int, start_rad: float) -> Array:
        angle = start_rad + np.linspace(0, 2 * np.pi, contacts, endpoint=False)
        u = np.column_stack([np.cos(angle), np.sin(angle)])
        reach = float(np.linalg.norm(self._contour.outline_K_m() - aim_m, axis=1).max()) + 2 * TIP_RADIUS_M
        steps = np.arange(reach, 0.0, -STEP_M)
        at = aim_m + steps[None, :, None] * u[:, None, :]  # (contacts, steps, 2), from outside inwards
        met = signed_distance(self._contour, at.reshape(-1, 2)).reshape(at.shape[:2]) <= TIP_RADIUS_M
        some = met.any(axis=1)
        return np.asarray(aim_m + steps[met.argmax(axis=1)][some, None] * u[some])
