"""Quantities of the paper's section IV-A from a TouchSet: openings, evidence, nonplanarity, action graph."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.recognition.model import PadSpec, Patch, hand_axes, patch_of
from glotouch_bt.perception.recognition.paper.params import PaperParams
from glotouch_bt.perception.touch import Layer, TouchSequence, TouchSet
from glotouch_bt.robot import Array

NO_CONTACT = Patch(False, float("nan"), 0.0)


@dataclass(frozen=True)
class SequenceReading:
    """One closure sequence k; only layers with contact.

    Attributes:
        index: Index of the sequence in the TouchSet.
        yaw_rad: Reference yaw of x_P in K.
        along_m: a_k, longitudinal coordinate of the reference pose, from the contour's centre.
        opening_m: (H,) measured openings y_{k,h}.
        height_m: (H,) pads' mid-point above the floor.
        weight: (H,) evidence w.
        bilateral: (H,) True with both pads in contact.
        across_m: (H,) y_P coordinate, from the contour's centre, of the point halfway between the touched surfaces.
        rho: rho_k, median nonplanarity over valid patches; NaN without any.
        q_depth: q_{D,k}, valid patches over pads of stable layers.
    """

    index: int
    yaw_rad: float
    along_m: float
    opening_m: Array
    height_m: Array
    weight: Array
    bilateral: npt.NDArray[np.bool_]
    across_m: Array
    rho: float
    q_depth: float


@dataclass(frozen=True)
class PaperObservation:
    """Quantities of one TouchSet.

    Attributes:
        sequences: Sequences with at least one valid layer.
        p_coupled: p_c.
        rho, q_depth: (K,) of all sequences, including those without a valid layer.
        evidence: Number of two-sided layers; all one-sided layers together add at most 1.
    """

    sequences: tuple[SequenceReading, ...]
    p_coupled: float
    rho: Array
    q_depth: Array
    evidence: float


def read_observation(touchset: TouchSet, pad: PadSpec, p: PaperParams) -> PaperObservation:
    """Extract the quantities of a TouchSet. Unstable, non-finite and contact-free layers are skipped."""
    usable = [(k, s) for k, s in enumerate(touchset.sequences) if _has_pose(s)]
    centre = np.asarray(touchset.candidate.contour.centre_K_m, dtype=np.float64)
    positions = np.array([s.position_K_m for _, s in usable], dtype=np.float64).reshape(-1, 2)
    yaws = np.array([s.yaw_rad for _, s in usable])
    axis = longitudinal_axis(positions, float(yaws[0])) if usable else np.array([1.0, 0.0])
    readings: list[SequenceReading] = []
    rho, q = [], []
    for (k, sequence), position in zip(usable, positions, strict=True):
        reading = _read_sequence(k, sequence, float(axis @ (position - centre)), centre, pad, p)
        rho.append(reading.rho)
        q.append(reading.q_depth)
        if len(reading.opening_m):
            readings.append(reading)
    both = sum(int(r.bilateral.sum()) for r in readings)
    single = sum(float(r.weight[~r.bilateral].sum()) for r in readings)
    return PaperObservation(
        tuple(readings), coupled_probability(positions, yaws, p), np.array(rho), np.array(q), both + min(single, 1.0)
    )


def longitudinal_axis(positions_K_m: Array, yaw_rad: float) -> Array:
    """Return the first right singular vector (2,) of the centred positions (K, 2), with the sign of x_P at `yaw_rad`.

    If all positions coincide, return x_P.
    """
    x, _ = hand_axes(np.asarray(yaw_rad))
    if len(positions_K_m) < 2:
        return np.asarray(x)
    centred = positions_K_m - positions_K_m.mean(axis=0)
    _, s, v = np.linalg.svd(centred, full_matrices=False)
    if s[0] < 1e-9:
        return np.asarray(x)
    return np.asarray(v[0] if v[0] @ x >= 0 else -v[0])


def coupled_probability(positions_K_m: Array, yaw_rad: Array, p: PaperParams) -> float:
    """Compute p_c of eq. (coupled_probability).

    Args:
        positions_K_m: (K, 2) reference positions of the open hand.
        yaw_rad: (K,) yaws of the down-pointing hand. Yaws that differ by half a turn are equal.
        p: Scales and floors.
    """
    if len(yaw_rad) == 0:
        return 0.0
    travel = float(np.ptp(positions_K_m @ longitudinal_axis(positions_K_m, float(yaw_rad[0]))))
    apart = np.abs((yaw_rad[:, None] - yaw_rad[None, :] + np.pi / 2) % np.pi - np.pi / 2)
    x = 3 * math.log(max(travel, p.floor_t_m) / p.tau_t_m)
    y = -3 * math.log(max(float(apart.max()), p.floor_R_rad) / p.tau_R_rad)
    return math.sqrt(_logistic(x) * _logistic(y))


def _logistic(x: float) -> float:
    return 1.0 / (1.0 + math.exp(-x))


def _has_pose(s: TouchSequence) -> bool:
    position = np.asarray(s.position_K_m, dtype=np.float64)
    return position.shape == (2,) and bool(np.isfinite(position).all()) and math.isfinite(s.yaw_rad)


def _patch(depth_m: Array, pad: PadSpec) -> Patch:
    return patch_of(depth_m, pad) if depth_m.ndim == 2 and depth_m.size else NO_CONTACT


def _readable(layer: Layer) -> bool:
    numbers = (layer.aperture_m, layer.height_m, layer.yaw_rad)
    return layer.stable and all(map(math.isfinite, numbers)) and layer.aperture_m > 0


def _read_sequence(
    k: int, sequence: TouchSequence, along_m: float, centre_K_m: Array, pad: PadSpec, p: PaperParams
) -> SequenceReading:
    stable = [layer for layer in sequence.layers if _readable(layer)]
    _, y_K = hand_axes(np.asarray(sequence.yaw_rad))
    rows: list[tuple[float, float, float, bool, float]] = []
    rho: list[float] = []
    valid = 0
    for layer in stable:
        left, right = _patch(layer.left_m, pad), _patch(layer.right_m, pad)
        felt = int(left.valid) + int(right.valid)
        valid += felt
        rho += [x.rho for x in (left, right) if x.valid and math.isfinite(x.rho)]
        if felt == 0:
            continue
        across = float(y_K @ (np.asarray(layer.position_K_m) - centre_K_m)) + 0.5 * (left.top_m - right.top_m)
        rows.append((layer.aperture_m, layer.height_m, 1.0 if felt == 2 else p.unilateral, felt == 2, across))
    table = np.array(rows, dtype=np.float64).reshape(-1, 5)
    return SequenceReading(
        k, sequence.yaw_rad, along_m, table[:, 0], table[:, 1], table[:, 2], table[:, 3] > 0.5, table[:, 4],
        float(np.median(rho)) if rho else float("nan"), valid / (2 * len(stable)) if stable else 0.0,
    )  # fmt: skip
