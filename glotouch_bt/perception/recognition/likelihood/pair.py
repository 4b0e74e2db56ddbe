"""Evidence of one TouchSet for one STL: marginal log ratio target : background, and pose posterior."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.recognition.decision import Fit
from glotouch_bt.perception.recognition.evidence import Evidence, read_evidence
from glotouch_bt.perception.recognition.likelihood.background import log_generic_images, log_generic_widths
from glotouch_bt.perception.recognition.likelihood.bands import Residual, log_banded_twin, residual
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.relief import LikelyPose, log_generic_reliefs, relief_ratio
from glotouch_bt.perception.recognition.likelihood.scalars import (
    contour_ratio,
    height_ratio,
    mode_ratio,
    shift_prior,
    yaw_prior,
)
from glotouch_bt.perception.recognition.likelihood.volumes import (
    Grid,
    Observed,
    image_ratios,
    log_sum,
    marginalise_slide,
    marginalise_turn,
    slide_matrix,
    width_ratios,
)
from glotouch_bt.perception.recognition.model import Array32, PadSpec, TargetHypothesis, TargetModel
from glotouch_bt.perception.recognition.placement import contour_pose, fitted_pose
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import Array

_read: deque[tuple[TouchSet, PadSpec, LikelihoodParams, TouchSetReading]] = deque(maxlen=32)

PRUNE_NATS = 5.0
"""A hypothesis is left out if its outline and height are less likely than the best one's by more than this, nats.
Source: ours; its closures would have to fit e^5 times better."""
HOPELESS_NATS = -10.0
"""No relief is predicted for a target of which the log ratio is below this without it: relief could not make up for it.
Source: ours."""
PARALLEL_RAD = math.radians(10.0)
"""Maximum yaw difference (modulo half a turn) of parallel tracks."""


@dataclass(frozen=True)
class TouchSetReading:
    """A TouchSet with its background densities; the same for every STL.

    Attributes:
        touchset: The touches.
        evidence: Their evidence.
        sequences: Valid layers with background densities, by sequence; empty sequences are skipped.
    """

    touchset: TouchSet
    evidence: Evidence
    sequences: tuple[tuple[Observed, ...], ...]


@dataclass(frozen=True, eq=False)
class Pair:
    """Evidence of one TouchSet for one STL.

    Attributes:
        index: Index of the candidate.
        log_ratio: log p(TouchSet | target) - log p(TouchSet | random object), tempered and calibrated.
        log_twin: log p(TouchSet | twin) - log p(TouchSet | target), from the widths, calibrated.
        terms: Terms of the ratio, nats before calibration: mode, height, contour; width and image at the best pose;
            pose: effect of the marginalisation over the pose; relief: only with gel images.
        log_pose: (72, nz) posterior of (relative yaw of the first sequence, height offset); None without contact.
        first_rad: Yaw of the first sequence's hand.
        bias_m: Best aperture bias.
        fit, pose_K_O, evidence: As in `Match`.
        hypothesis: The likeliest way in which the target stands.
    """

    index: int
    log_ratio: float
    log_twin: float
    terms: dict[str, float]
    log_pose: Array32 | None
    first_rad: float
    bias_m: float
    fit: Fit | None
    pose_K_O: tuple[float, float, float]
    evidence: float
    hypothesis: TargetHypothesis


def read_touchset(touchset: TouchSet, pad: PadSpec, p: LikelihoodParams) -> TouchSetReading:
    """Compute evidence and background densities of a TouchSet; the newest results are cached by identity."""
    for known, spec, q, reading in _read:
        if known is touchset and spec == pad and q == p:
            return reading
    reading = _read_touchset(touchset, pad, p)
    _read.appendleft((touchset, pad, p, reading))
    return reading


def _read_touchset(touchset: TouchSet, pad: PadSpec, p: LikelihoodParams) -> TouchSetReading:
    e = read_evidence(touchset, pad)
    images = log_generic_images(e.layers, pad, p)
    widths = log_generic_widths(e.layers, touchset.candidate, p)
    reliefs = log_generic_reliefs(e.layers, p)
    seen: dict[int, list[Observed]] = {}
    for layer, width, image, relief in zip(e.layers, widths, images.tolist(), reliefs.tolist(), strict=True):
        seen.setdefault(layer.sequence, []).append(Observed(layer, float(width), tuple(image), tuple(relief)))
    return TouchSetReading(touchset, e, tuple(tuple(v) for _, v in sorted(seen.items())))


def compare(model: TargetModel, reading: TouchSetReading, p: LikelihoodParams) -> Pair:
    """Compute the evidence, summed over the target's hypotheses; pose and terms are those of the likeliest.

    Hypotheses that outline and height make far less likely than the best are left out.
    """
    candidate = reading.touchset.candidate
    terms = [_scalar_terms(h.model, candidate, p) for h in model.hypotheses]
    cheap = np.array(
        [math.log(h.weight) + p.slope * sum(t.values()) for h, t in zip(model.hypotheses, terms, strict=True)]
    )
    pairs = [
        (_compare(h, reading, t, p), math.log(h.weight))
        for h, t, c in zip(model.hypotheses, terms, cheap, strict=True)
        if c > cheap.max() - PRUNE_NATS
    ]
    best = max(pairs, key=lambda x: x[0].log_ratio + x[1])[0]
    total = float(np.logaddexp.reduce([x.log_ratio + w for x, w in pairs]))
    return replace(best, log_ratio=total)


def _scalar_terms(model: TargetModel, candidate: Candidate, p: LikelihoodParams) -> dict[str, float]:
    terms = {
        "mode": mode_ratio(model, candidate),
        "height": height_ratio(model, candidate, p),
        "contour": contour_ratio(model, candidate, p),
    }
    return {name: p.temper_outline * value for name, value in terms.items()}


def _compare(
    hypothesis: TargetHypothesis, reading: TouchSetReading, terms: dict[str, float], p: LikelihoodParams
) -> Pair:
    """Compute the evidence for one hypothesis, marginalised over bias, yaw, height, and each sequence's shift and turn.

    Args:
        hypothesis: How the target stands.
        reading: Background evidence of the touches.
        terms: Those of outline and height.
        p: Parameters.
    """
    model, touchset = hypothesis.model, reading.touchset
    candidate = touchset.candidate
    if not reading.sequences:
        ratio = p.outline_offset + p.slope * sum(terms.values())
        pose = contour_pose(touchset)
        return Pair(candidate.index, ratio, 0.0, terms, None, 0.0, 0.0, None, pose, 0.0, hypothesis)
    bias_sd = _bias_sd_m(reading, p)
    grid = Grid.of(p, bias_sd)
    first = reading.sequences[0][0].layer.yaw_rad
    turns = np.array([seen[0].layer.yaw_rad - first for seen in reading.sequences])
    parallel = bool(np.abs((turns + np.pi / 2) % np.pi - np.pi / 2).max() < PARALLEL_RAD)
    common = yaw_prior(model, candidate, first, p)[None, :, None, None] + _log_normal(grid.z0_m, p.z0_sd_m)
    if parallel:  # parallel tracks share one shift along x_P; each may slide
        common = common + shift_prior(model, candidate, 0.0, grid.shift_m, p)[None, :, :, None]
    twin = common.astype(np.float32)
    log_bias = _log_normal(grid.bias_m, bias_sd)
    joint = (common + log_bias[:, None, None, None]).astype(np.float32)
    slide = slide_matrix(grid, p)
    moved = observed_turns(touchset)
    parts = []
    for seen, turn in zip(reading.sequences, turns, strict=True):
        flip = bool(np.cos(turn) < 0)
        sd = math.hypot(p.turn_sd_rad, moved[seen[0].layer.sequence])
        widths, twins, offs = width_ratios(model, seen, turn, grid, p)
        widths, twins = np.float32(p.temper_width) * widths, np.float32(p.temper_width) * twins
        images = np.float32(p.temper_image) * image_ratios(model, seen, turn, grid, p)
        volume = np.concatenate([widths, twins]) + images[None]  # the twin is appended on the bias axis
        if parallel:
            volume = volume[:, :, ::-1] if flip else volume
            mean = marginalise_turn(marginalise_slide(volume, slide), p, sd)
        else:
            volume = volume + shift_prior(model, candidate, turn, grid.shift_m, p)[None, :, :, None].astype(np.float32)
            mean = marginalise_turn(log_sum(volume, 2), p, sd)[:, :, None]
        joint, twin = joint + mean[:-1], twin + mean[-1:]
        parts.append((widths, images, volume, flip, offs))
    total = float(log_sum(joint.reshape(1, -1), 1)[0])
    by_places = float(log_sum(twin.reshape(1, -1), 1)[0]) - total
    felt: list[Residual] = []
    b, i, c, z = (int(k) for k in np.unravel_index(int(np.argmax(joint)), joint.shape))
    shifts = np.zeros(len(touchset.sequences))
    terms["width"] = terms["image"] = 0.0
    for seen, (widths, images, volume, flip, offs) in zip(reading.sequences, parts, strict=True):
        d = _best_shift(volume, slide if parallel else None, flip, (b, i, c, z))
        shifts[seen[0].layer.sequence] = grid.shift_m[d]
        terms["width"] += float(widths[b, i, d, z])
        terms["image"] += float(images[i, d, z])
        sharp = [(o, at) for o, at in zip(seen, offs, strict=True) if not o.layer.upper_only]
        felt += [r for o, at in sharp if (r := residual(at, o, (i, d, z)))]
    by_bands = p.temper_width * log_banded_twin(felt, grid.bias_m, log_bias, p)
    log_twin = p.twin_slope * 0.5 * (by_places + by_bands)
    terms["pose"] = total - terms["width"] - terms["image"]
    log_pose = log_sum(joint, (0, 2))
    if _has_relief(reading) and p.offset + p.slope * sum(terms.values()) > HOPELESS_NATS:

        def shifts_at(at: tuple[int, int, int, int]) -> Array:
            found = np.zeros(len(touchset.sequences))
            for seen, (_, _, volume, flip, _) in zip(reading.sequences, parts, strict=True):
                d = _best_shift(volume, slide if parallel else None, flip, at)
                found[seen[0].layer.sequence] = grid.shift_m[d]
            return found

        poses = _likely_poses(model, joint, log_pose, grid, shifts_at, p.relief_poses)
        layers = [
            (o.layer, float(turn), o.log_reliefs)
            for seen, turn in zip(reading.sequences, turns, strict=True)
            for o in seen
        ]
        terms["relief"] = relief_ratio(model, layers, poses, p)
    yaw = _refined(log_sum(log_pose, 1), i)
    fit, pose = fitted_pose(
        model, touchset, reading.evidence, yaw, shifts, float(grid.z0_m[z]), 1.0, float(grid.bias_m[b])
    )
    ratio = p.offset + p.slope * sum(terms.values())
    return Pair(
        candidate.index, ratio, log_twin, terms, np.asarray(log_pose - total, dtype=np.float32), first,
        float(grid.bias_m[b]), fit, pose, reading.evidence.weight, hypothesis,
    )  # fmt: skip


def _best_shift(volume: Array32, slide: Array32 | None, flip: bool, at: tuple[int, int, int, int]) -> int:
    """Return the index of a sequence's likeliest shift at (bias, yaw, common shift, height offset).

    `slide` is the probability of a sequence's shift given the common one of parallel tracks; None if they are not.
    """
    b, i, c, z = at
    along = volume[b, i, :, z] + (0 if slide is None else np.log(slide[:, c]))
    d = int(np.argmax(along))
    return volume.shape[2] - 1 - d if slide is not None and flip else d


def _has_relief(reading: TouchSetReading) -> bool:
    return any(o.layer.relief is not None for seen in reading.sequences for o in seen)


def _likely_poses(
    model: TargetModel,
    joint: Array32,
    log_pose: Array32,
    grid: Grid,
    shifts_at: Callable[[tuple[int, int, int, int]], Array],
    count: int,
) -> list[LikelyPose]:
    """Return the `count` likeliest pairs of yaw and height offset, each with its likeliest shifts."""
    best = np.argsort(-log_pose, axis=None, kind="stable")[:count]
    weights = np.exp(log_pose.reshape(-1)[best] - log_pose.max()).astype(np.float64)
    poses = []
    for k, weight in zip(best.tolist(), (weights / weights.sum()).tolist(), strict=True):
        i, z = divmod(k, log_pose.shape[1])
        b, c = divmod(int(np.argmax(joint[:, i, :, z])), joint.shape[2])
        shift_m = shifts_at((b, i, c, z))
        poses.append(LikelyPose(weight, float(model.phi_rad[i]), float(grid.z0_m[z]), shift_m))
    return poses


def observed_turns(touchset: TouchSet) -> list[float]:
    """Return the total observed turn, rad, from the first closure to the end of each sequence.

    The turn of the first closure precedes its measurement and is excluded. Unobserved turns count as 0.
    """
    total, out = 0.0, []
    for k, sequence in enumerate(touchset.sequences):
        for layer in sequence.layers[1 if k == 0 else 0 :]:
            total += abs(layer.turn_rad) if math.isfinite(layer.turn_rad) else 0.0
        out.append(total)
    return out


def _bias_sd_m(reading: TouchSetReading, p: LikelihoodParams) -> float:
    """Return the standard deviation of the error of all widths: zero of the aperture, scale, offset of both sides."""
    zero_sd = max(layer.zero_sd_m for layer in reading.touchset.layers)
    width = float(np.median([o.layer.width_m for seen in reading.sequences for o in seen]))
    return math.hypot(zero_sd, p.scale_sd * width, 2 * p.offset_sd_m)


def _log_normal(x: Array, sd: float) -> Array:
    weight = np.exp(-0.5 * (x / sd) ** 2)
    return np.asarray(np.log(weight / weight.sum()))


def _refined(log_profile: Array32, i: int) -> float:
    """Return the vertex of the parabola through the maximum and its neighbours, in table steps."""
    n = len(log_profile)
    a, b, c = float(log_profile[i - 1]), float(log_profile[i]), float(log_profile[(i + 1) % n])
    curve = a - 2 * b + c
    if not math.isfinite(curve) or curve > -1e-6:
        return float(i)
    return i + float(np.clip(0.5 * (a - c) / curve, -0.5, 0.5))
