"""Synthetic acquisition: contacts and squeezes of a mesh at a pose, without a simulator.

It shares no table with the recognition model: every pad is ray-cast at full resolution at the true pose, and the gel is
solved for each frame (`gel_shift`). Coupled jaws slide the object until it is centred. Not modelled:
toppling, slip along x_P, gel shear, friction, contact outside the gel except `one_sided`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from glotouch_bt.perception.recognition.model import (
    SENSING_M,
    TIP_RADIUS_M,
    PadSpec,
    first_hit,
    gel_shift,
    hand_axes,
    minimum_rectangle,
    traced_tips,
)
from glotouch_bt.perception.touch import Candidate, Contact, Layer, TouchSequence, TouchSet, fit_contour
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import Mesh

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """Spreads (sd) and ranges of the synthetic acquisition; aperture and depth as in glotouch_missions/conditions.

    Attributes:
        aperture_sd_m, aperture_bias_m: Noise, and uniform +- bias of a TouchSet.
        depth_sd_m, depth_offset_m, dead: Noise, uniform +- offset, fraction of dead taxels.
        drift_m, drift_rad: Motion of the object between two sequences.
        turn_rad: Motion within a sequence.
        contact_sd_m: Noise of one probe contact.
        centre_sd_m: Error of the contour as a whole.
        height_sd_m: Error of the top.
        datum_sd_m: Error of the floor's height.
        one_sided: Probability that one finger's back carries the force and its pad feels nothing.
        stiffness_sd: Relative error of the gel's stiffness.
        unstable: Probability of a layer without a plateau.
    """

    aperture_sd_m: float = 0.0
    aperture_bias_m: float = 0.0
    depth_sd_m: float = 0.0
    depth_offset_m: float = 0.0
    dead: float = 0.0
    drift_m: float = 0.0
    drift_rad: float = 0.0
    turn_rad: float = 0.0
    contact_sd_m: float = 0.0
    centre_sd_m: float = 0.0
    height_sd_m: float = 0.0
    datum_sd_m: float = 0.0
    one_sided: float = 0.0
    stiffness_sd: float = 0.0
    unstable: float = 0.0


IDEAL = Disturbance()
NOMINAL = Disturbance(
    aperture_sd_m=5e-5, aperture_bias_m=4e-4, depth_sd_m=2e-5, depth_offset_m=2e-5, dead=0.005, drift_m=1.2e-3,
    drift_rad=math.radians(2.5), turn_rad=math.radians(1.0), contact_sd_m=4e-4, centre_sd_m=1e-3, height_sd_m=1e-3,
    datum_sd_m=7e-4, one_sided=0.05, stiffness_sd=0.1, unstable=0.03,
)  # fmt: skip
HARSH = Disturbance(
    aperture_sd_m=1.5e-4, aperture_bias_m=1e-3, depth_sd_m=5e-5, depth_offset_m=5e-5, dead=0.03, drift_m=2e-3,
    drift_rad=math.radians(4.0), turn_rad=math.radians(2.0), contact_sd_m=1e-3, centre_sd_m=2e-3, height_sd_m=2e-3,
    datum_sd_m=1.5e-3, one_sided=0.15, stiffness_sd=0.3, unstable=0.1,
)  # fmt: skip

FORCE_N = 10.0
LOWEST_M, TOP_OVERLAP_M, LAYERS = 0.018, 0.008, 4
JAWS_M = 0.085


def acquire(
    mesh: Mesh,
    pose_K_O: tuple[float, float, float],
    disturbance: Disturbance,
    rng: np.random.Generator,
    index: int = 0,
    pad: PadSpec | None = None,
) -> tuple[TouchSet, tuple[float, float, float]]:
    """Trace, touch from above and squeeze `mesh` standing at `pose_K_O` (x, y, yaw).

    Returns:
        The TouchSet and the pose after the last squeeze.
    """
    pad = pad or PadSpec()
    solid = mesh.as_trimesh()
    gel = true_gel(pad, disturbance, rng)
    candidate = traced(solid, np.array(pose_K_O), disturbance, rng, index)
    pose = np.array(pose_K_O, dtype=np.float64)
    contour = candidate.contour
    if contour.kind == "round":
        base = rng.uniform(0, np.pi)
        plan = [(contour.centre_K_m, base + t) for t in np.deg2rad([0.0, 60.0, 120.0])]
    else:
        along = np.array([np.cos(contour.yaw_rad), np.sin(contour.yaw_rad)])
        plan = [(contour.centre_K_m + t * contour.size_m[0] * along, contour.yaw_rad) for t in (-0.25, 0.0, 0.25)]
    top = max(candidate.height_m - TOP_OVERLAP_M, LOWEST_M)
    heights = np.linspace(LOWEST_M, top, LAYERS if top > LOWEST_M + 0.012 else 2)
    bias = rng.uniform(-1, 1) * disturbance.aperture_bias_m
    datum = rng.normal(0, disturbance.datum_sd_m)
    sequences = []
    for position, yaw in plan:
        pose[:2] += rng.normal(0, disturbance.drift_m, 2)
        pose[2] += rng.normal(0, disturbance.drift_rad)
        layers = []
        for h in heights:
            pose[2] += rng.normal(0, disturbance.turn_rad)
            layer, pose = squeeze(solid, pose, position, float(yaw), float(h), datum, bias, disturbance, gel, rng)
            layers.append(layer)
        sequences.append(TouchSequence(np.asarray(position), float(yaw), tuple(layers)))
    return TouchSet(candidate, tuple(sequences)), (float(pose[0]), float(pose[1]), float(pose[2]))


def true_gel(pad: PadSpec, d: Disturbance, rng: np.random.Generator) -> PadSpec:
    """Return the pad with the gel that is really there."""
    stiffness = pad.stiffness_N_m3 * float(np.exp(rng.normal(0, d.stiffness_sd)))
    return PadSpec(pad.window_m, pad.shape, pad.depth_m, stiffness, pad.limit_m, FORCE_N)


def traced(
    solid: trimesh.Trimesh, pose: Array, d: Disturbance, rng: np.random.Generator, index: int, *, contacts: bool = False
) -> Candidate:
    """Return the candidate that the probe would trace; with `contacts` they are compared with the target's section."""
    middle = minimum_rectangle(np.asarray(solid.vertices)[:, :2])[3]
    tips = traced_tips(solid, middle + rng.normal(0, 4e-3, 2), int(rng.integers(8, 13)), rng.uniform(0, 2 * np.pi))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    turn = np.array([[c, -s], [s, c]])
    tips = tips @ turn.T + pose[:2] + rng.normal(0, d.contact_sd_m, tips.shape) + rng.normal(0, d.centre_sd_m, 2)
    contour = fit_contour(tips, TIP_RADIUS_M)
    height = float(solid.vertices[:, 2].max()) + rng.normal(0, d.height_sd_m)
    return Candidate(index, contour, height, 1.0, _contacts(tips) if contacts else ())


def _contacts(tips_m: Array) -> tuple[Contact, ...]:
    """Return the contacts of ball centres (k, 2) that came from outside towards their mean."""
    inward = tips_m.mean(axis=0) - tips_m
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-9)
    return tuple(
        Contact(float(i), np.array([*tip, SENSING_M]), np.array([*way, 0.0]), np.array([*-way, 0.0]),
                tip + TIP_RADIUS_M * way, 1.0)
        for i, (tip, way) in enumerate(zip(tips_m, inward, strict=True))
    )  # fmt: skip


def squeeze(
    solid: trimesh.Trimesh, pose: Array, position: Array, yaw: float, height: float, datum: float, bias: float,
    d: Disturbance, gel: PadSpec, rng: np.random.Generator,
) -> tuple[Layer, Array]:  # fmt: skip
    """One closure; returns the layer and the pose the object slid to."""
    rows, cols = gel.shape
    x_K, y_K = hand_axes(np.asarray(yaw))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    back = np.array([[c, s], [-s, c]])
    x_O, y_O, p_O = back @ x_K, back @ y_K, back @ (np.asarray(position) - pose[:2])
    u = ((np.arange(cols) + 0.5) / cols - 0.5) * gel.window_m[0]
    v = height + datum - ((np.arange(rows) + 0.5) / rows - 0.5) * gel.window_m[1]
    far = 0.3
    reach = []
    for sign in (1.0, -1.0):  # left pad at +y_P looks along -y_P
        o = np.zeros((rows, cols, 3))
        o[..., :2] = p_O + u[None, :, None] * x_O + sign * far * y_O
        o[..., 2] = v[:, None]
        ray = np.zeros_like(o)
        ray[..., :2] = -sign * y_O
        reach.append(far - first_hit(solid, o.reshape(-1, 3), ray.reshape(-1, 3)))
    tops = [float(r.max()) for r in reach]
    empty = np.zeros((rows, cols))
    closed = Layer(height, 0.0, np.asarray(position), yaw, empty, empty, 0.0, False)
    if not all(map(math.isfinite, tops)) or sum(tops) > JAWS_M:
        return closed, pose
    cell = gel.window_m[0] * gel.window_m[1] / (rows * cols)
    depths, sunk = [], []
    for r, top in zip(reach, tops, strict=True):
        sink = float(gel_shift(r - top, cell, FORCE_N, gel)[0])
        sunk.append(sink)
        depths.append(np.clip(r - top + sink, 0, gel.depth_m).reshape(rows, cols))
    aperture = sum(tops) - sum(sunk)
    # Coupled jaws: the object slides along y_P until both pads press alike.
    slide = -0.5 * ((tops[0] - sunk[0]) - (tops[1] - sunk[1]))
    pose = pose + np.array([*(slide * y_K), 0.0])
    if rng.random() < d.one_sided:
        side = int(rng.integers(2))
        depths[side] = np.zeros((rows, cols))
        aperture += sunk[side] + rng.uniform(0, 2e-3)
    aperture = round(aperture + bias + rng.normal(0, d.aperture_sd_m), 5)
    seen = []
    for depth in depths:
        m = depth + rng.normal(0, d.depth_sd_m, depth.shape) + rng.uniform(-1, 1) * d.depth_offset_m
        m = np.clip(m, 0, gel.depth_m)
        m[rng.random(depth.shape) < d.dead] = np.nan
        seen.append(m)
    stable = bool(rng.random() >= d.unstable)
    return Layer(height, aperture, np.asarray(position), yaw, seen[0], seen[1], FORCE_N, stable), pose
