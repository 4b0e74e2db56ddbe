"""Likelihood of a candidate's probe contacts: the target's section in an unknown pose, against any outline.

Any outline is the mixture of shape families that the contacts are fitted with (`perception.touch.outline`). Both
likelihoods are densities of the same data: the ball's centres and the bearings of the reactions.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.model import (
    LEVELS_M,
    TIP_RADIUS_M,
    Indices,
    SectionTables,
    TableAt,
    TargetModel,
    TargetSection,
)
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.perception.touch.outline import infer_outline_from_contacts, wrapped
from glotouch_bt.robot import Array

SCATTER_M = (0.5e-3, 1.0e-3, 2.0e-3)
"""Standard deviations of a contact from the target's section, with equal prior probability: objects are pushed by
contacts. Source: 0.3 to 1.7 mm on the objects of 13 missions (`lying_five`, realistic)."""
NORMAL_SD_RAD = 0.25
"""Standard deviation of the reaction's bearing about the section's normal: friction turns it. Source: the same
missions, 0.14 to 0.4 rad."""
OUTLIER = 0.05
"""Probability of a contact with something else, or before an unseen motion. Source: ours."""
OUTLIER_RANGE_M = 0.040
"""Range of the uniform density of such contacts. Source: ours; half an object."""
CENTRE_SD_M = 0.025
"""Prior standard deviation of the section's middle about that of the contacts, as of other outlines."""
STARTS = 72
"""Number of yaws from which the pose is fitted."""
SIFT_STEP, SIFTED = 2, 14
"""Step of the descent after which only this number of the best starts continue."""
LEVEL_PRIOR = np.log([0.5, 0.25, 0.25])
"""Log prior probabilities of the heights of the sensing plane, `LEVELS_M`. Source: ours."""
STEPS = 8
"""Steps of the descent."""
PRIOR_WEIGHT = np.array([1.0, 1.0, 0.0]) / CENTRE_SD_M**2
"""Inverse variances of the pose's prior."""
UNLIKELY_NATS = 12.0
"""Poses less likely than the best by more than this are left out."""
YAW_WEIGHT = np.array([0.0, 0.0, 1.0])
"""Inverse variances that bound the volume of the yaws of a round section."""
LONGEST_STEP = np.array([0.008, 0.008, 0.1])
"""Longest step of the descent, m and rad."""
MIN_CONTACTS = 3
"""Least number of contacts that are compared with a section."""
BALL_TOLERANCE_M = 1e-3
"""Contacts are of the ball if its centre is at its radius from the contact point within this."""
SAME_RAD = math.radians(3.0)
"""Fitted poses closer than this are one."""
_GENERIC_NORMAL_SD_RAD = 0.20
_MEMORY = 256


@dataclass(frozen=True, eq=False)
class SectionFit:
    """Comparison of a candidate's contacts with a section.

    Attributes:
        log_ratio: log p(contacts | section) - log p(contacts | any outline), nats.
        log_weight: (m,) log posterior probabilities of the fitted poses.
        pose_K: (m, 3) their x, y of the section's origin in K, m, and yaw, rad.
        yaw_sd_rad: (m,) standard deviation of the yaw.
    """

    log_ratio: float
    log_weight: Array
    pose_K: Array
    yaw_sd_rad: Array

    def term(self, p: LikelihoodParams) -> float:
        """Return the tempered log ratio; a trace that went wrong says nothing."""
        return math.log((1.0 - p.trace_outlier) * math.exp(p.temper_contacts * self.log_ratio) + p.trace_outlier)

    def yaw_weight(self, yaw_rad: Array, p: LikelihoodParams) -> Array:
        """Return the probabilities (n,) of yaws (n,) in K, which sum to 1."""
        near = self._log_near(yaw_rad, p)
        weight = np.exp(near - near.max()).sum(axis=1)
        return np.asarray(0.9 * weight / weight.sum() + 0.1 / len(yaw_rad))

    def middle_K_m(self, yaw_rad: Array, p: LikelihoodParams) -> Array:
        """Return the place (n, 2) of the section's origin for yaws (n,) in K: that of the nearest likely pose."""
        return self.pose_K[self._log_near(yaw_rad, p).argmax(axis=1), :2]

    def _log_near(self, yaw_rad: Array, p: LikelihoodParams) -> Array:
        """Return the log weight (n, m) of each fitted pose at yaws (n,): a closure may have turned the object."""
        off = wrapped(yaw_rad[:, None] - self.pose_K[:, 2]) / np.hypot(self.yaw_sd_rad, p.yaw_sd_rad)
        return np.asarray(p.temper_contacts * self.log_weight - 0.5 * off**2)


_fits: deque[tuple[tuple[TargetSection, ...], tuple[Contact, ...], list[SectionFit]]] = deque(maxlen=_MEMORY)
_outlines: deque[tuple[tuple[Contact, ...], float]] = deque(maxlen=_MEMORY)


def are_of_ball(contacts: tuple[Contact, ...]) -> bool:
    """Return True if there are enough contacts, and the ball made them, not another section."""
    if len(contacts) < MIN_CONTACTS:
        return False
    off = [math.dist(c.tip_K_m[:2], c.point_K_m) - TIP_RADIUS_M for c in contacts]
    return abs(float(np.median(off))) < BALL_TOLERANCE_M


def section_fits(models: Sequence[TargetModel], candidate: Candidate) -> list[SectionFit | None]:
    """Compare a candidate's contacts with the section of each model.

    A fit is None if the model has no section. All are None if the ball made too few contacts. The newest results are
    kept.
    """
    sections = tuple(m.section for m in models if m.section is not None)
    if not sections or not are_of_ball(candidate.contacts):
        return [None] * len(models)
    fits = iter(_known_fits(sections, candidate.contacts))
    return [None if m.section is None else next(fits) for m in models]


def gain_of_one(model: TargetModel, a: Candidate, b: Candidate) -> float:
    """Return the gain of log evidence, nats, if the contacts of two candidates are all with the target.

    The alternative is two objects, of which one may be the target. It is -inf if the contacts are not compared with the
    target.
    """
    both = replace(a, contacts=tuple(sorted((*a.contacts, *b.contacts), key=lambda c: c.stamp_s)))

    def by_target(candidate: Candidate) -> float:
        fits = section_fits([h.model for h in model.hypotheses], candidate)
        logs = [np.log(h.weight) + f.log_ratio for h, f in zip(model.hypotheses, fits, strict=True) if f is not None]
        return float(np.logaddexp.reduce(logs)) + _log_any_outline(candidate.contacts) if logs else -np.inf

    apart = [_log_any_outline(c.contacts) for c in (a, b)]
    two = max(sum(apart), by_target(a) + apart[1], apart[0] + by_target(b))
    return by_target(both) - two


def _known_fits(sections: tuple[TargetSection, ...], contacts: tuple[Contact, ...]) -> list[SectionFit]:
    for known, of, fits in _fits:
        if of is contacts and len(known) == len(sections) and all(a is b for a, b in zip(known, sections, strict=True)):
            return fits
    fits = _fit(sections, contacts)
    _fits.appendleft((sections, contacts, fits))
    return fits


def _log_any_outline(contacts: tuple[Contact, ...]) -> float:
    """Return the log likelihood of contacts with one object of any outline, or, rarely, with anything."""
    for of, value in _outlines:
        if of is contacts:
            return value
    outline = infer_outline_from_contacts(contacts, TIP_RADIUS_M).log_evidence
    anything = math.log(OUTLIER) + len(contacts) * math.log(_GENERIC_NORMAL_SD_RAD / OUTLIER_RANGE_M)
    value = float(np.logaddexp(outline, anything))
    _outlines.appendleft((contacts, value))
    return value


def _fit(sections: Sequence[TargetSection], contacts: tuple[Contact, ...]) -> list[SectionFit]:
    """Fit poses to the contacts by damped Gauss-Newton steps from all yaws, for all sections at once.

    After `SIFT_STEP` steps only the best starts of each section go on, at every height of the sensing plane.
    """
    seen, tables, count = _Seen.of(contacts), SectionTables.of(sections), len(sections)
    which, level = np.arange(count).repeat(STARTS), np.zeros(count * STARTS, dtype=np.int64)
    start = np.column_stack([np.tile(seen.middle, (STARTS, 1)), np.arange(STARTS) * (2 * np.pi / STARTS)])
    pose, damping = np.tile(start, (count, 1)), np.full(len(which), 1e-2)
    sd = SCATTER_M[1]
    table = tables.table_at(which, level)
    loss, off, slope = seen.loss(tables, table, pose, sd)
    for step in range(STEPS):
        if step == SIFT_STEP:
            best = np.argsort(loss.reshape(count, STARTS), axis=1, kind="stable")[:, :SIFTED]
            best = (best + STARTS * np.arange(count)[:, None]).ravel().repeat(len(LEVELS_M))
            pose, damping, which = pose[best], damping[best], which[best]
            level = np.tile(np.arange(len(LEVELS_M)), count * SIFTED)
            table = tables.table_at(which, level)
            loss, off, slope = seen.loss(tables, table, pose, sd)
        weight = 1.0 / (1.0 + (off / sd) ** 2 / 9.0) / sd**2
        weighed = weight[..., None] * slope
        hessian = weighed.transpose(0, 2, 1) @ slope + np.diag(PRIOR_WEIGHT + 1e-3)
        gradient = (weighed * off[..., None]).sum(axis=1) + (pose - seen.centre) * PRIOR_WEIGHT
        damped = hessian * (1.0 + damping[:, None, None] * np.eye(3))
        move = np.clip(-np.linalg.solve(damped, gradient[..., None])[..., 0], -LONGEST_STEP, LONGEST_STEP)
        trial_loss, trial_off, trial_slope = seen.loss(tables, table, pose + move, sd)
        better = trial_loss < loss
        pose[better] += move[better]
        loss[better], off[better], slope[better] = trial_loss[better], trial_off[better], trial_slope[better]
        damping *= np.where(better, 0.3, 5.0)
    kept = [_distinct(np.flatnonzero(which == i), loss, level, pose) for i in range(count)]
    every = np.concatenate(kept)
    pose, level, table = pose[every], level[every], (table[0][every], table[1][every])
    logs, yaw_sd = zip(*(seen.evidence(tables, table, pose, sd) for sd in SCATTER_M), strict=True)
    by_pose = np.logaddexp.reduce(np.array(logs), axis=0) + LEVEL_PRIOR[level]
    widest, any_outline, ends = np.max(yaw_sd, axis=0), _log_any_outline(contacts), np.cumsum([len(k) for k in kept])
    fits = []
    for part in np.split(np.arange(len(every)), ends[:-1]):
        total = float(np.logaddexp.reduce(by_pose[part]))
        fits.append(SectionFit(total - any_outline, by_pose[part] - total, pose[part], widest[part]))
    return fits


def _distinct(of: Indices, loss: Array, level: Indices, pose: Array) -> Indices:
    """Return the indices of the likely poses among those of indices `of`, the best first.

    Of poses at the same level that differ in yaw by less than `SAME_RAD`, only the best is kept.
    """
    order = of[np.argsort(loss[of], kind="stable")]
    order = order[loss[order] <= loss[order[0]] + UNLIKELY_NATS]
    apart = np.abs(wrapped(pose[order, 2][:, None] - pose[order, 2])) > SAME_RAD
    apart |= level[order][:, None] != level[order]
    kept: list[int] = []
    for i in range(len(order)):
        if apart[i, kept].all():
            kept.append(i)
    return np.asarray(order[kept])


@dataclass(frozen=True, eq=False)
class _Seen:
    """Contacts as they are compared: ball centres (k, 2), bearings (k,) of the reactions, and the prior's mean."""

    tips: Array
    bearing: Array
    middle: Array
    centre: Array

    @classmethod
    def of(cls, contacts: tuple[Contact, ...]) -> _Seen:
        tips = np.array([c.tip_K_m[:2] for c in contacts])
        reaction = np.array([c.reaction_K[:2] for c in contacts])
        middle = 0.5 * (tips.min(axis=0) + tips.max(axis=0))
        return cls(tips, np.arctan2(reaction[:, 1], reaction[:, 0]), middle, np.array([*middle, 0.0]))

    def loss(self, tables: SectionTables, table: TableAt, pose: Array, sd_m: float) -> tuple[Array, Array, Array]:
        """Return negative log densities (s,) for poses (s, 3), distances (s, k), and their derivatives (s, k, 3)."""
        off, turned, slope = self._residuals(tables, table, pose)
        prior = 0.5 * ((pose - self.centre) ** 2 * PRIOR_WEIGHT).sum(axis=1)
        return prior - _log_density(off, turned, sd_m).sum(axis=1), off, slope

    def evidence(self, tables: SectionTables, table: TableAt, pose: Array, sd_m: float) -> tuple[Array, Array]:
        """Return the log evidence (s,) about each pose (s, 3), by Laplace's method, and the yaw's deviations (s,)."""
        loss, off, slope = self.loss(tables, table, pose, sd_m)
        weight = 1.0 / (1.0 + (off / sd_m) ** 2 / 9.0) / sd_m**2
        hessian = (weight[..., None] * slope).transpose(0, 2, 1) @ slope + np.diag(PRIOR_WEIGHT + YAW_WEIGHT)
        volume = -0.5 * np.linalg.slogdet(hessian)[1] - 2 * math.log(CENTRE_SD_M) - 0.5 * math.log(2 * math.pi)
        return volume - loss - math.log(len(SCATTER_M)), np.sqrt(np.linalg.inv(hessian)[:, 2, 2])

    def _residuals(self, tables: SectionTables, table: TableAt, pose: Array) -> tuple[Array, Array, Array]:
        """Return distances (s, k), bearings less those of the normals (s, k), and derivatives (s, k, 3) of the
        distances, for poses (s, 3)."""
        c, s = np.cos(pose[:, 2:]), np.sin(pose[:, 2:])
        dx, dy = self.tips[:, 0] - pose[:, :1], self.tips[:, 1] - pose[:, 1:2]
        x, y = c * dx + s * dy, c * dy - s * dx
        distance, gx, gy = tables.look_up(x, y, table)
        slope = np.stack([s * gy - c * gx, -(s * gx + c * gy), gx * y - gy * x], axis=-1)
        return distance, wrapped(self.bearing - np.arctan2(gy, gx) - pose[:, 2:]), slope


def _log_density(off_m: Array, turned_rad: Array, sd_m: float) -> Array:
    """Return log densities (s, k) of contacts, without the constants that other outlines leave out as well."""
    near = np.exp(-0.5 * ((off_m / sd_m) ** 2 + (turned_rad / NORMAL_SD_RAD) ** 2))
    near *= (1 - OUTLIER) / sd_m * (_GENERIC_NORMAL_SD_RAD / NORMAL_SD_RAD)
    return np.log(near + OUTLIER * _GENERIC_NORMAL_SD_RAD / OUTLIER_RANGE_M)
