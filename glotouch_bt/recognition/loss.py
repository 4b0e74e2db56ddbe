"""The matching loss of a TouchSet against a target: eq. (matching_loss) and what the candidate itself tells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.recognition.decision import Match
from glotouch_bt.recognition.evidence import Evidence, read_evidence
from glotouch_bt.recognition.model import TargetModel
from glotouch_bt.recognition.outline import SENSING_M
from glotouch_bt.recognition.pads import Array32
from glotouch_bt.recognition.params import LossParams
from glotouch_bt.recognition.placement import fitted_pose, unfelt_pose
from glotouch_bt.recognition.raster import hand_axes
from glotouch_bt.recognition.volume import Grid, cross_loss, sequence_volume
from glotouch_bt.robot import Array
from glotouch_bt.touch.values import Candidate, Contour, TouchSet

UNFELT_M = 0.003
"""A candidate not higher than this above where its sides were touched: its top was not felt."""


def match(model: TargetModel, touchset: TouchSet, params: LossParams | None = None) -> Match:
    """Loss and fitted pose of one pair; deterministic. A TouchSet that no pad felt has infinite loss and evidence 0."""
    p = params or LossParams()
    evidence = read_evidence(touchset, model.pad, p)
    candidate = touchset.candidate
    if not evidence.layers:
        return Match(candidate.index, math.inf, {}, None, unfelt_pose(touchset), 0.0)
    best: _Best | None = None
    for scale in p.scales:
        found = _width_loss(model, evidence, candidate, Grid.of(p, scale), p)
        if best is None or found.loss < best.loss:
            best = found
    assert best is not None
    terms = {"width": best.loss - best.image, "image": best.image}
    if p.depth > 0:
        terms["depth"] = depth_loss(model, evidence, p)
    if p.mode > 0:
        terms["mode"] = mode_loss(model, evidence, candidate, p)
    if p.height > 0:
        terms["height"] = height_loss(model, candidate, p)
    if p.contour > 0:
        terms["contour"] = contour_loss(model, candidate, p)
    fit, pose = fitted_pose(model, touchset, evidence, best.yaw_index, best.shift_m, best.z0_m, best.scale, best.bias_m)
    return Match(candidate.index, float(sum(terms.values())), terms, fit, pose, evidence.weight)


@dataclass(frozen=True)
class _Best:
    loss: float
    image: float
    yaw_index: float
    shift_m: Array
    z0_m: float
    bias_m: float
    scale: float


def _width_loss(model: TargetModel, e: Evidence, candidate: Candidate, grid: Grid, p: LossParams) -> _Best:
    """Minimum over the grid of both branches and their mixture, eq. (soft_action_graph)."""
    used = sorted({layer.sequence for layer in e.layers})
    first = float(e.yaw_rad[used[0]])
    turns = np.array([float(e.yaw_rad[k]) - first for k in used])
    parallel = np.abs((turns + np.pi / 2) % np.pi - np.pi / 2).max() < math.radians(10.0)
    flips = np.where(np.cos(turns) < 0, -1.0, 1.0) if parallel else np.ones(len(used))
    volumes, priors = [], []
    for k, turn, flip in zip(used, turns, flips, strict=True):
        layers = [layer for layer in e.layers if layer.sequence == k]
        volumes.append(sequence_volume(model, layers, float(turn), float(flip), grid, p))
        priors.append(_shift_prior(model, candidate, float(turn), float(flip), grid, p))
    share = np.array([v.weight.sum() for v in volumes])
    share = (share / share.sum()).astype(np.float32)
    common = _pose_prior(model, candidate, first, grid, p) + _bias_prior(grid, p)  # (nb, 72, nz)
    losses = [v.loss + q for v, q in zip(volumes, priors, strict=True)]
    if parallel:
        joint = sum(s * _drift(x, p) for s, x in zip(share, losses, strict=True))
        cross = cross_loss([v.residual_m for v in volumes], volumes, p)
        joint = joint + np.float32(p.w_cross) * cross + common[:, :, None, :]
        at = np.unravel_index(int(np.argmin(joint)), joint.shape)
        shifts = np.full(len(used), grid.shift_m[at[2]]) * flips
        profile = joint.min(axis=(0, 2, 3))
        where = (int(at[0]), int(at[1]), int(at[3]))
        image = float(sum(s * v.image[at[1:]] for s, v in zip(share, volumes, strict=True)))
        coupled = float(joint[at])
    else:
        chosen = [x.argmin(axis=2) for x in losses]  # (nb, 72, nz)
        least = [np.take_along_axis(x, c[:, :, None], axis=2)[:, :, 0] for x, c in zip(losses, chosen, strict=True)]
        joint = sum(s * _drift(x[:, :, None], p)[:, :, 0] for s, x in zip(share, least, strict=True))
        picked = [
            np.stack(
                [
                    np.take_along_axis(np.broadcast_to(r, (len(c), *r.shape)), c[:, :, None], axis=2)[:, :, 0]
                    for r in v.residual_m
                ]
            )
            for v, c in zip(volumes, chosen, strict=True)
        ]
        joint = joint + np.float32(p.w_cross) * cross_loss(picked, volumes, p) + common
        at = np.unravel_index(int(np.argmin(joint)), joint.shape)
        where = (int(at[0]), int(at[1]), int(at[2]))
        shifts = np.array([grid.shift_m[c[at]] for c in chosen])
        profile = joint.min(axis=(0, 2))
        image = float(sum(s * v.image[at[1], c[at], at[2]] for s, v, c in zip(share, volumes, chosen, strict=True)))
        coupled = float(joint[at])
    prior_s = p.scale_prior * abs(math.log(grid.scale)) * (1 + model.anisotropy)
    loss = coupled + prior_s
    if not p.known_motion:
        separate = float(np.median([(x + common[:, :, None, :]).min() for x in losses]))
        loss = e.p_coupled * coupled + (1 - e.p_coupled) * separate + prior_s
    all_shifts = np.full(len(e.yaw_rad), float(np.mean(shifts)) if parallel else 0.0)
    all_shifts[used] = shifts
    yaw = _refined(profile, where[1])
    return _Best(
        loss, p.image * image, yaw, all_shifts, float(grid.z0_m[where[2]]), float(grid.bias_m[where[0]]), grid.scale
    )


def _drift(x: Array32, p: LossParams) -> Array32:
    """Let a sequence differ from the common yaw (and so absorb the object's turning) at a price a table step."""
    steps = int(p.drift_yaw_rad / (2 * np.pi / x.shape[1]) + 1e-6)
    out = x
    for n in range(1, steps + 1):
        cost = np.float32(p.drift_cost * n * n)
        out = np.minimum(out, np.minimum(np.roll(x, n, axis=1), np.roll(x, -n, axis=1)) + cost)
    return out


def _refined(profile: Array32, i: int) -> float:
    """Vertex of the parabola through the least value and its neighbours, in table steps."""
    n = len(profile)
    a, b, c = float(profile[i - 1]), float(profile[i]), float(profile[(i + 1) % n])
    curve = a - 2 * b + c
    return i + (float(np.clip(0.5 * (a - c) / curve, -0.5, 0.5)) if curve > 1e-9 else 0.0)


def _shift_prior(
    model: TargetModel, candidate: Candidate, turn: float, flip: float, grid: Grid, p: LossParams
) -> Array32:
    """(1, 72, nd, 1): the contour's centre is where the model's own outline, fitted alike, has its centre."""
    traced = model.outline.of(candidate.contour.kind)
    x, _ = hand_axes(model.phi_rad + turn)
    off = flip * grid.shift_m[None, :] - (x @ traced.centre_m)[:, None]
    variance = p.shift_sd_m**2 + traced.centre_sd_m**2
    return np.asarray(p.shift_prior * 0.5 * off**2 / variance, dtype=np.float32)[None, :, :, None]


def _pose_prior(model: TargetModel, candidate: Candidate, first: float, grid: Grid, p: LossParams) -> Array32:
    """(1, 72, nz): height offset near 0; a box's contour lies along the model's."""
    z = p.z0_prior * 0.5 * (grid.z0_m / p.z0_sd_m) ** 2
    yaw = np.zeros(len(model.phi_rad))
    contour, o = candidate.contour, model.outline.as_box
    if p.yaw_prior > 0 and contour.kind == "box":
        off = first - model.phi_rad + o.yaw_rad - contour.yaw_rad
        off = (off + np.pi / 2) % np.pi - np.pi / 2
        slender = min(o.size_m[0] / o.size_m[1], contour.size_m[0] / max(contour.size_m[1], 1e-3)) - 1
        trust = float(np.clip(slender / 0.2, 0, 1))
        yaw = p.yaw_prior * trust * np.log1p(0.5 * off**2 / (p.yaw_sd_rad**2 + o.yaw_sd_rad**2))
    return np.asarray(yaw[:, None] + z[None, :], dtype=np.float32)[None]


def _bias_prior(grid: Grid, p: LossParams) -> Array32:
    return np.asarray(p.bias * np.abs(grid.bias_m) / p.bias_limit_m, dtype=np.float32)[:, None, None]


def depth_loss(model: TargetModel, e: Evidence, p: LossParams) -> float:
    """Eq. (depth_loss) times lambda_D. Fewer valid patches must not lower it, so q_D only gates it (0 if none)."""
    rho = e.rho[np.isfinite(e.rho)]
    if len(rho) == 0:
        return 0.0
    information = model.normal_dispersion / (model.normal_dispersion + p.depth_eps)
    gate = float(e.q_depth.mean()) if p.paper_mode else 1.0
    weight = p.depth / (1 + p.depth_anisotropy * model.anisotropy)
    return weight * float(np.median(np.log1p(((rho - model.rho) / p.depth_sd) ** 2))) * gate * information


def mode_loss(model: TargetModel, e: Evidence, candidate: Candidate, p: LossParams) -> float:
    """Collection mode: -log P(kind | the model's own outline), or the paper's a_M^2 (1 - p_c)."""
    if p.paper_mode:
        return p.mode * model.anisotropy**2 * (1 - e.p_coupled)
    box = model.outline.p_box
    return -p.mode * math.log(max(box if candidate.contour.kind == "box" else 1 - box, p.mode_floor))


def height_loss(model: TargetModel, candidate: Candidate, p: LossParams) -> float:
    """Highest place felt against the model's top; a top that was not felt says only how high the object is at least."""
    off = candidate.height_m - model.height_m
    if candidate.height_m < SENSING_M + UNFELT_M:
        off = max(off, 0.0)
    return p.height * math.log1p(0.5 * (off / p.height_sd_m) ** 2)


def contour_loss(model: TargetModel, candidate: Candidate, p: LossParams) -> float:
    """Contour's size against the model's own outline fitted as the same kind.

    The model's spread is that of evenly spread contacts; a trace that ended early is less sure, and says how much.
    """
    contour = candidate.contour
    traced = model.outline.of(contour.kind)
    sides = 2 if contour.kind == "box" else 1
    squared = 0.0
    for i in range(sides):
        variance = p.contour_sd_m**2 + traced.size_sd_m[i] ** 2 + _size_variance_m2(contour, i)
        squared += (contour.size_m[i] - traced.size_m[i]) ** 2 / variance
    return p.contour * math.log1p(0.5 * squared)


def _size_variance_m2(contour: Contour, side: int) -> float:
    """Variance of a whole side from the fit's covariance of the half; 0 where the fit does not tell."""
    at = {"circle": 2, "rectangle": 3 + side}.get(contour.family or "", len(contour.covariance))
    variance = 4.0 * float(contour.covariance[at, at]) if at < len(contour.covariance) else 0.0
    return variance if math.isfinite(variance) else 0.0
