"""Fine relief of the target under the pads, predicted from its STL at likely poses, and its log ratio to a background.

The images of the gels show edges, ridges and grooves that pooled depth maps do not. A table of them over all poses
would be large. So the relief is predicted only at the likeliest poses of widths and depth maps, by rays against the
mesh, and the ratio is averaged over these poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from glotouch_bt.perception.recognition.evidence import LayerEvidence
from glotouch_bt.perception.recognition.likelihood.background import mixed_density, neighbours_of
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.model import Array32, PadSpec, TargetModel, first_hit, gel_shift, hand_axes
from glotouch_bt.perception.touch import BLOCKS, relief_of_surface
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import ByDigest

if TYPE_CHECKING:
    import trimesh

CELLS = (14 * BLOCKS[0], 12 * BLOCKS[1])
"""Rows and columns of a predicted window: cells of 0.29 mm. Source: ours, the resolution of a measured relief."""
FLOOR = 0.02
"""RMS slope below which reliefs hardly differ: roughness and noise. Source: on four pairs of `tests/support/
relief_pairs.py` with seed 9001, in `realistic`, predicted and measured features of plain walls and of walls with relief
then differ equally, by 0.2 to 0.5."""


@dataclass(frozen=True)
class LikelyPose:
    """One of the likeliest poses of the target.

    Attributes:
        weight: Its probability among them.
        yaw_rad: Yaw of the first sequence's hand relative to the target.
        z0_m: Height offset.
        shift_m: (sequences,) shift of the target along x_P.
    """

    weight: float
    yaw_rad: float
    z0_m: float
    shift_m: Array


def relief_feature(relief: Array) -> Array:
    """Return the feature (..., 70) of the relief (..., 2, 7, 5) of one pad: log(1 + slope / FLOOR).

    Above `FLOOR`, equal ratios of slopes count equally, as the error of a prediction grows with the slope.
    """
    return np.asarray(np.log1p(relief / FLOOR).reshape(*relief.shape[:-3], -1))


def relief_ratio(
    model: TargetModel,
    layers: Sequence[tuple[LayerEvidence, float, tuple[float, float]]],
    poses: Sequence[LikelyPose],
    p: LikelihoodParams,
) -> float:
    """Return the log ratio target : background of the reliefs of all images, averaged over poses; 0 without images.

    Args:
        model: The target; without a mesh, nothing is known of its relief.
        layers: Each layer, the yaw of its hand from that of the first sequence, and its background log densities.
        poses: Likely poses.
        p: Parameters.
    """
    seen = [(e, turn, log_generic, side) for e, turn, log_generic in layers for side in sides_of(e)]
    if model.mesh is None or not seen:
        return 0.0
    windows = np.array(
        [
            (q.yaw_rad + turn, e.along_m + q.shift_m[e.sequence], e.height_m + q.z0_m, 1.0 - 2.0 * side)
            for q in poses
            for e, turn, _, side in seen
        ]
    )
    predicted = relief_feature(predicted_relief(model, windows)).reshape(len(poses), len(seen), -1)
    measured = np.stack([relief_feature(e.relief[side]) for e, _, _, side in seen if e.relief is not None])
    squared = ((predicted - measured) ** 2).mean(axis=-1)
    background = np.array([log_generic[side] for _, _, log_generic, side in seen])
    density = (1 - p.relief_outlier) * relief_kernel(squared, p) * np.exp(-background) + p.relief_outlier
    joint = p.temper_relief * np.log(density).sum(axis=1) + np.log([q.weight for q in poses])
    return float(np.logaddexp.reduce(joint))


def sides_of(e: LayerEvidence) -> tuple[int, ...]:
    """Return the pads (0 left, 1 right) of a layer that touched and have an image."""
    return () if e.relief is None else tuple(i for i in (0, 1) if e.images[i] is not None)


def relief_kernel(squared: Array, p: LikelihoodParams) -> Array:
    """Return the unnormalised density of a relief at mean squared feature distance `squared` from a prediction."""
    return np.asarray((1 + squared / p.relief_scale**2) ** -p.relief_order)


def predicted_relief(model: TargetModel, windows: Array) -> Array:
    """Return the relief (n, 2, 7, 5) of the target pressed into the gel of a pad, for each window.

    Args:
        model: The target, with its mesh.
        windows: (n, 4): yaw of the hand relative to the target, x_P coordinate and height of the window's middle, and
            1 for the left or -1 for the right pad.
    """
    pad = model.pad
    pitch = pad.window_m[1] / CELLS[0], pad.window_m[0] / CELLS[1]
    depth = np.stack([_pressed(_heights(model, w, pitch), pad) for w in windows])
    return relief_of_surface(depth, pitch)


def _heights(model: TargetModel, window: Array, pitch_m: tuple[float, float]) -> Array32:
    """Return the surface (rows, columns) towards a pad, m along the closing direction; -inf where there is none."""
    yaw, along_m, height_m, side = window.tolist()
    assert model.mesh is not None
    solid = _solid(ByDigest(model.mesh))
    x, y = hand_axes(np.asarray(yaw))
    rows, columns = CELLS
    l = along_m + (np.arange(columns) - 0.5 * (columns - 1)) * pitch_m[1]
    z = height_m - (np.arange(rows) - 0.5 * (rows - 1)) * pitch_m[0]
    far = float(np.abs(model.l_m).max()) * 1.5 + 0.05
    origin = np.zeros((rows, columns, 3))
    origin[..., :2] = model.centre_m + l[None, :, None] * x + side * far * y
    origin[..., 2] = z[:, None]
    direction = np.broadcast_to([*(-side * y), 0.0], origin.shape)
    hit = first_hit(solid, origin.reshape(-1, 3), direction.reshape(-1, 3))
    return np.asarray((far - hit).reshape(rows, columns), dtype=np.float32)


def _pressed(heights: Array32, pad: PadSpec) -> Array32:
    """Return the indentation (rows, columns) of the gel by a surface."""
    top = heights.max()
    if not np.isfinite(top):
        return np.zeros_like(heights)
    relative = (heights - top).reshape(1, -1)
    shift = gel_shift(relative, pad.window_m[0] * pad.window_m[1] / heights.size, pad.force_N, pad)
    return np.asarray(np.clip(relative + shift, 0.0, pad.depth_m).reshape(heights.shape), dtype=np.float32)


@lru_cache(maxsize=64)
def _solid(key: ByDigest) -> trimesh.Trimesh:
    return key.mesh.as_trimesh()


LEVELS = (0.0, 0.01, 0.03, 0.1, 0.3)
"""RMS slopes of the background's reliefs: each pair along z_P and x_P, the same in all touched blocks. Source: ours."""
TOUCHED = 0.1
"""Least image feature (sqrt(mm)) of a touched block: a mean depth of 0.06 mm."""


def generic_densities(e: LayerEvidence, p: LikelihoodParams) -> dict[int, float]:
    """Return the background density of each pad's relief if neither neighbours nor target are known."""
    out = {}
    for side in sides_of(e):
        image = e.images[side]
        assert image is not None  # by `sides_of`
        assert e.relief is not None
        touched = image.reshape(BLOCKS) > TOUCHED
        library = np.array([[a * touched, b * touched] for a in LEVELS for b in LEVELS])
        squared = ((relief_feature(library) - relief_feature(e.relief[side])) ** 2).mean(axis=1)
        out[side] = float(relief_kernel(squared, p).mean())
    return out


def log_generic_reliefs(layers: Sequence[LayerEvidence], p: LikelihoodParams) -> Array:
    """Return the background log density (n, 2) of (left, right) reliefs, in units of log `relief_kernel`; 0 without."""
    features: Mapping[tuple[int, int, int], Array] = {
        (e.sequence, e.index, side): relief_feature(e.relief[side])
        for e in layers
        for side in sides_of(e)
        if e.relief is not None
    }
    out = np.zeros((len(layers), 2))
    for i, e in enumerate(layers):
        for side, anything in generic_densities(e, p).items():
            mine = features[e.sequence, e.index, side]
            beside = neighbours_of(e, side)
            alike = [relief_kernel(((mine - features[k]) ** 2).mean(), p) for k in beside if k in features]
            out[i, side] = math.log(mixed_density(anything, [float(a) for a in alike], p) + 1e-12)
    return out
