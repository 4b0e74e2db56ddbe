"""A TouchSet as numbers the loss can use: which layers count, how wide, what the pads showed, how the hand moved."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.recognition.pads import PadSpec, image_feature, patch_of, pool
from glotouch_bt.recognition.params import LossParams
from glotouch_bt.recognition.raster import hand_axes
from glotouch_bt.robot import Array
from glotouch_bt.touch.values import TouchSet


@dataclass(frozen=True)
class LayerEvidence:
    """One layer that carries evidence.

    Attributes:
        sequence: Its sequence.
        index: Its place in the sequence.
        width_m: Rigid width: aperture plus what sank into the gels.
        weight: 1 if both pads felt it, `LossParams.unilateral` if one.
        upper_only: One pad felt nothing, so the true width in the window is at most `width_m`.
        yaw_rad: Of the hand in K.
        along_m: x_P coordinate of the hand's middle, from the contour's centre.
        height_m: Of the pads' mid-point.
        images: (left, right) features (35,), or None for a pad that felt nothing.
        rhos: Nonplanarity of the valid patches.
        sunk_m: (left, right) indentation of the highest point.
    """

    sequence: int
    index: int
    width_m: float
    weight: float
    upper_only: bool
    yaw_rad: float
    along_m: float
    height_m: float
    images: tuple[Array | None, Array | None]
    rhos: tuple[float, ...]
    sunk_m: tuple[float, float]


@dataclass(frozen=True)
class Evidence:
    """All of one TouchSet.

    Attributes:
        layers: The layers that count.
        yaw_rad: (K,) yaw of each sequence in K.
        taken: (K,) layers tried in each sequence.
        p_coupled: Eq. (coupled_probability).
        q_depth: (K,) fraction of valid tactile patches, the paper's q_{D,k}.
        rho: (K,) median nonplanarity; NaN where no patch is valid.
        weight: How much was felt: layers both pads felt, plus the others' weights, which together count at most one.
    """

    layers: tuple[LayerEvidence, ...]
    yaw_rad: Array
    taken: Array
    p_coupled: float
    q_depth: Array
    rho: Array
    weight: float


def read_evidence(touchset: TouchSet, pad: PadSpec, params: LossParams) -> Evidence:
    """Reduce a TouchSet. Unstable layers, and layers neither pad felt, are left out (paper IV-A)."""
    centre = touchset.candidate.contour.centre_K_m
    layers: list[LayerEvidence] = []
    q, rho = [], []
    for k, sequence in enumerate(touchset.sequences):
        valid, values = 0, []
        for h, layer in enumerate(sequence.layers):
            if not layer.stable or not math.isfinite(layer.aperture_m) or not math.isfinite(layer.height_m):
                continue
            if layer.left_m.ndim != 2 or layer.right_m.ndim != 2:
                continue
            patches = [patch_of(d, pad) for d in (layer.left_m, layer.right_m)]
            felt = sum(p.valid for p in patches)
            valid += felt
            values += [p.rho for p in patches if p.valid and math.isfinite(p.rho)]
            if felt == 0:
                continue
            left, right = (
                np.asarray(image_feature(pool(d)), dtype=np.float64) if p.valid else None
                for d, p in zip((layer.left_m, layer.right_m), patches, strict=True)
            )
            x, _ = hand_axes(np.asarray(layer.yaw_rad))
            layers.append(
                LayerEvidence(
                    k,
                    h,
                    layer.aperture_m + sum(p.top_m for p in patches),
                    1.0 if felt == 2 else params.unilateral,
                    felt < 2,
                    float(layer.yaw_rad),
                    float(x @ (np.asarray(layer.position_K_m) - centre)),
                    layer.height_m,
                    (left, right),
                    tuple(p.rho for p in patches if p.valid and math.isfinite(p.rho)),
                    (patches[0].top_m, patches[1].top_m),
                )
            )
        q.append(valid / (2 * len(sequence.layers)) if sequence.layers else 0.0)
        rho.append(float(np.median(values)) if values else float("nan"))
    return Evidence(
        tuple(layers),
        np.array([s.yaw_rad for s in touchset.sequences]),
        np.array([len(s.layers) for s in touchset.sequences]),
        coupled_probability(touchset, params),
        np.array(q),
        np.array(rho),
        sum(e.weight for e in layers if not e.upper_only) + min(sum(e.weight for e in layers if e.upper_only), 1.0),
    )


def coupled_probability(touchset: TouchSet, params: LossParams) -> float:
    """p_c of eq. (coupled_probability) from the sequences' open poses. Turning the hand by 180 deg is no rotation."""
    p = np.array([s.position_K_m for s in touchset.sequences], dtype=np.float64).reshape(-1, 2)
    yaw = np.array([s.yaw_rad for s in touchset.sequences])
    if len(p) < 2:
        return 0.5
    d = p - p.mean(axis=0)
    axis = np.linalg.svd(d, full_matrices=False)[2][0]
    travel = max(float(np.ptp(d @ axis)), 1e-4)
    turn = np.abs((yaw[:, None] - yaw[None, :] + np.pi / 2) % np.pi - np.pi / 2)
    rotation = max(float(turn.max()), 1e-2)

    def sigma(x: float) -> float:
        return 1.0 / (1.0 + math.exp(-x))

    return math.sqrt(sigma(3 * math.log(travel / params.tau_t_m)) * sigma(-3 * math.log(rotation / params.tau_R_rad)))
