"""Evidence of one TouchSet for one STL: marginal log ratio target : background, and pose posterior."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.recognition.decision import Fit
from glotouch_bt.perception.recognition.evidence import Evidence, read_evidence
from glotouch_bt.perception.recognition.likelihood.background import log_generic_images, log_generic_widths
from glotouch_bt.perception.recognition.likelihood.bands import Residual, log_banded_twin, residual
from glotouch_bt.perception.recognition.likelihood.contacts import SectionFit, section_fits
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
    WidthVolumes,
    image_ratios,
    log_sum,
    marginalised,
    slide_matrix,
    turn_matrix,
    twin_ratios,
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
        terms: Terms of the ratio, nats before calibration: height; section, or mode and contour; width and image at
            the best pose; pose: effect of the marginalisation over the pose; relief: only with gel images.
        log_pose: (72, nz) posterior of (relative yaw of the first sequence, height offset); None without contact.
        first_rad: Yaw of the first sequence's hand.
        bias_m: Best aperture bias.
        fit, pose_K_O, evidence: As in `Match`.
        hypothesis: The likeliest way in which the target stands.
        section: The candidate's contacts in its section; None if they are not compared with it.
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
    section: SectionFit | None = None


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
    fits = section_fits([h.model for h in model.hypotheses], candidate)
    terms = [_scalar_terms(h.model, candidate, f, p) for h, f in zip(model.hypotheses, fits, strict=True)]
    cheap = np.array(
        [math.log(h.weight) + p.slope * sum(t.values()) for h, t in zip(model.hypotheses, terms, strict=True)]
    )
    kept = [i for i, c in enumerate(cheap) if c > cheap.max() - PRUNE_NATS]
    searches = [_Search.of(model.hypotheses[i], reading, terms[i], fits[i], p) for i in kept]
    log_ratios = [s.log_ratio + math.log(s.hypothesis.weight) for s in searches]
    best = searches[int(np.argmax(log_ratios))]
    return best.pair(float(np.logaddexp.reduce(log_ratios)), p)


def _scalar_terms(
    model: TargetModel, candidate: Candidate, fit: SectionFit | None, p: LikelihoodParams
) -> dict[str, float]:
    terms = {"height": height_ratio(model, candidate, p)}
    if fit is not None:
        terms |= {"section": fit.term(p)}
    else:
        terms |= {"mode": mode_ratio(model, candidate), "contour": contour_ratio(model, candidate, p)}
    return {name: p.temper_outline * value for name, value in terms.items()}


@dataclass(frozen=True, eq=False)
class _SearchedSequence:
    """One sequence in a search; log ratios are tempered.

    Attributes:
        seen: Its layers.
        turn_rad: Yaw of its hand from that of the first sequence.
        shift: Probability of each shift: (nd, nd), given the common one of parallel tracks; else (nd, 72), by yaw.
        turn: Probability of each turn, `turn_matrix`.
        widths, images: (nb, 72, nd, nz) and (72, nd, nz) log ratios.
        volumes: The widths of its layers.
    """

    seen: tuple[Observed, ...]
    turn_rad: float
    shift: Array32
    turn: Array32
    widths: Array32
    images: Array32
    volumes: WidthVolumes

    def marginal(self, widths: Array32) -> Array32:
        """Return the log ratio, marginalised over its own shift and turn, with given log ratios of widths."""
        return marginalised(widths + self.images[None], self.shift, self.turn)

    def best_shift(self, at: tuple[int, int, int, int]) -> int:
        """Return the index of the likeliest shift at (bias, yaw, common shift, height offset)."""
        b, i, c, z = at
        prior = self.shift[:, c if self.shift.shape[1] == len(self.shift) else i]
        return int(np.argmax(self.widths[b, i, :, z] + self.images[i, :, z] + np.log(prior)))


@dataclass(frozen=True, eq=False)
class _Search:
    """The evidence for one hypothesis, marginalised over bias, yaw, height, and each sequence's shift and turn.

    Attributes:
        hypothesis: How the target stands.
        reading: Background evidence of the touches.
        terms: Terms of outline, height and relief.
        section: As in `Pair`.
        grid: Grid of the nuisances.
        common: Log prior of yaw, shift and height offset.
        log_bias: (nb,) log prior of the bias.
        parts: The sequences.
        joint: (nb, 72, nd or 1, nz) log ratio before the last marginalisation.
        total: Log ratio of widths and images.
        log_ratio: As in `Pair`, of this hypothesis alone.
    """

    hypothesis: TargetHypothesis
    reading: TouchSetReading
    terms: dict[str, float]
    section: SectionFit | None
    grid: Grid
    common: Array
    log_bias: Array
    parts: tuple[_SearchedSequence, ...]
    joint: Array32
    total: float
    log_ratio: float

    @classmethod
    def of(
        cls, hypothesis: TargetHypothesis, reading: TouchSetReading, terms: dict[str, float], fit: SectionFit | None,
        p: LikelihoodParams,
    ) -> _Search:  # fmt: skip
        """Search the poses; `terms` are those of outline and height, `fit` is that of the contacts."""
        model, touchset = hypothesis.model, reading.touchset
        bias_sd = _bias_sd_m(reading, p) if reading.sequences else p.offset_sd_m
        grid = Grid.of(p, bias_sd)
        log_bias = _log_normal(grid.bias_m, bias_sd)
        if not reading.sequences:
            ratio = p.outline_offset + p.slope * sum(terms.values())
            none = np.zeros((1, 1, 1, 1))
            return cls(
                hypothesis, reading, terms, fit, grid, none, log_bias, (), none.astype(np.float32), 0.0, ratio
            )  # fmt: skip
        first = reading.sequences[0][0].layer.yaw_rad
        turns = np.array([seen[0].layer.yaw_rad - first for seen in reading.sequences])
        parallel = bool(np.abs((turns + np.pi / 2) % np.pi - np.pi / 2).max() < PARALLEL_RAD)
        yaws = yaw_prior(model, touchset.candidate, fit, first, p)
        common = yaws[None, :, None, None] + _log_normal(grid.z0_m, p.z0_sd_m)

        def shift_at(turn_rad: float) -> Array:
            phi = model.phi_rad + turn_rad
            return shift_prior(model, touchset.candidate, fit, first + turn_rad, phi, grid.shift_m, p)

        if parallel:  # parallel tracks share one shift along x_P; each may slide
            common = common + shift_at(0.0)[None, :, :, None]
        slide = slide_matrix(grid, p)
        moved = observed_turns(touchset)
        parts = []
        images = image_ratios(model, reading.sequences, turns.tolist(), grid, p)
        felt = width_ratios(model, reading.sequences, turns.tolist(), grid, p)
        for seen, turn, image, (widths, volumes) in zip(reading.sequences, turns.tolist(), images, felt, strict=True):
            if parallel:  # the hand may point the other way
                shift = slide if np.cos(turn) >= 0 else slide[::-1]
            else:
                shift = np.exp(shift_at(turn).T).astype(np.float32)
            sd = math.hypot(p.turn_sd_rad, moved[seen[0].layer.sequence])
            tempered = np.float32(p.temper_width) * widths, np.float32(p.temper_image) * image
            moves = shift, turn_matrix(len(model.phi_rad), sd, p.slip)
            parts.append(_SearchedSequence(seen, turn, *moves, *tempered, volumes))
        joint = (common + log_bias[:, None, None, None]).astype(np.float32)
        for part in parts:
            joint = joint + part.marginal(part.widths)
        total = float(log_sum(joint.reshape(1, -1), 1)[0])
        found = cls(hypothesis, reading, terms, fit, grid, common, log_bias, tuple(parts), joint, total, 0.0)
        return found._with_relief(p)

    def shift_indices(self, at: tuple[int, int, int, int]) -> list[int]:
        """Return the index of each sequence's likeliest shift at (bias, yaw, common shift, height offset)."""
        return [part.best_shift(at) for part in self.parts]

    def shifts_m(self, indices: Sequence[int]) -> Array:
        """Return the shifts of all sequences of the TouchSet; 0 for those without evidence."""
        shifts = np.zeros(len(self.reading.touchset.sequences))
        for part, d in zip(self.parts, indices, strict=True):
            shifts[part.seen[0].layer.sequence] = self.grid.shift_m[d]
        return shifts

    def _with_relief(self, p: LikelihoodParams) -> _Search:
        ratio = p.offset + p.slope * (sum(self.terms.values()) + self.total)
        if not _has_relief(self.reading) or ratio <= HOPELESS_NATS:
            return replace(self, log_ratio=ratio)
        model = self.hypothesis.model
        poses = _likely_poses(
            model, self.joint, log_sum(self.joint, (0, 2)), self.grid,
            lambda at: self.shifts_m(self.shift_indices(at)), p.relief_poses,
        )  # fmt: skip
        layers = [(o.layer, part.turn_rad, o.log_reliefs) for part in self.parts for o in part.seen]
        relief = relief_ratio(model, layers, poses, p)
        return replace(self, terms=self.terms | {"relief": relief}, log_ratio=ratio + p.slope * relief)

    def pair(self, log_ratio: float, p: LikelihoodParams) -> Pair:
        """Return the evidence of all hypotheses, `log_ratio`, with the pose of this one, the likeliest."""
        touchset, grid = self.reading.touchset, self.grid
        index, weight = touchset.candidate.index, self.reading.evidence.weight
        if not self.parts:
            pose = contour_pose(touchset)
            return Pair(
                index, log_ratio, 0.0, self.terms, None, 0.0, 0.0, None, pose, 0.0, self.hypothesis, self.section
            )  # fmt: skip
        b, i, c, z = (int(k) for k in np.unravel_index(int(np.argmax(self.joint)), self.joint.shape))
        at = self.shift_indices((b, i, c, z))
        width = sum(float(part.widths[b, i, d, z]) for part, d in zip(self.parts, at, strict=True))
        image = sum(float(part.images[i, d, z]) for part, d in zip(self.parts, at, strict=True))
        terms = {k: v for k, v in self.terms.items() if k != "relief"}
        terms |= {"width": width, "image": image, "pose": self.total - width - image} | self.terms
        log_pose = log_sum(self.joint, (0, 2))
        fit, pose = fitted_pose(
            self.hypothesis.model, touchset, self.reading.evidence, _refined(log_sum(log_pose, 1), i),
            self.shifts_m(at), float(grid.z0_m[z]), 1.0, float(grid.bias_m[b]),
        )  # fmt: skip
        first = self.reading.sequences[0][0].layer.yaw_rad
        return Pair(
            index, log_ratio, self._log_twin((i, z), at, p), terms, np.asarray(log_pose - self.total, dtype=np.float32),
            first, float(grid.bias_m[b]), fit, pose, weight, self.hypothesis, self.section,
        )  # fmt: skip

    def _log_twin(self, at: tuple[int, int], shifts: Sequence[int], p: LikelihoodParams) -> float:
        """Return `Pair.log_twin`; `at` and `shifts` are the indices of the best yaw, height offset and shifts."""
        twin = self.common.astype(np.float32)
        felt: list[Residual] = []
        for part, d in zip(self.parts, shifts, strict=True):
            widths = np.float32(p.temper_width) * twin_ratios(part.volumes, part.seen, p)
            twin = twin + part.marginal(widths)
            sharp = [(k, o) for k, o in enumerate(part.seen) if not o.layer.upper_only]
            felt += [r for k, o in sharp if (r := residual(part.volumes, k, o, (at[0], d, at[1])))]
        by_places = float(log_sum(twin.reshape(1, -1), 1)[0]) - self.total
        by_bands = p.temper_width * log_banded_twin(felt, self.grid.bias_m, self.log_bias, p)
        return p.twin_slope * 0.5 * (by_places + by_bands)


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
