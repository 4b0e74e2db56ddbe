"""Contact guard: the soft rule that ends a guarded move (paper III-A). `hard_stop` is independent of it.

Signal: LPF(wrench - baseline - payload inertia), fused to a force at the tip. Rule: the opposing force AND the total
force (or the moment) exceed their thresholds for N consecutive samples. The rule is applied twice: to a fast filter,
and to a slow one with lower thresholds, since a light object gives way to less force than the fast one can tell from
noise.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.touch.detection.baseline import Baseline
from glotouch_bt.perception.touch.detection.filtering import LowPass
from glotouch_bt.perception.touch.detection.fusion import TipFusion
from glotouch_bt.perception.touch.detection.guard_params import GuardParams
from glotouch_bt.perception.touch.detection.onset import onset_index
from glotouch_bt.robot import Array, Observation, ParamError, Pose, frozen_array, quat_to_matrix

HISTORY_BLOCKS = 10
"""Number of blocks kept to date an onset: 100 ms at 100 Hz; the last third may belong to the contact."""
DRIFT_S = 2.0
"""Time constant of the baseline while a paused motion stands: slower changes are drift (0.02 N in
conditions/harsh.yaml)."""

SUSTAINED_SIGMAS_RATIO = 1.5
"""Standard deviations of a force that lasts, over those of the fast rule: what lasts is not white noise. Source: ours;
at 1, free motion in harsh conditions was not silent for five minutes (tests/bench/detection)."""

ANY_DIRECTION = np.zeros(3)
"""Stands for the direction of motion where none is required."""


@dataclass(frozen=True)
class Onset:
    """The beginning of a contact.

    Attributes:
        stamp_s: Robot clock at the beginning of the contact (sensor latency removed).
        position_B_P: (3,) pads' mid-point in B at that time.
        quat_B_P: (4,) its orientation at that time.
        force_B: (3,) filtered force on the tip when the guard tripped, in B.
        peak_N: Maximum unfiltered tip force up to the end of that block.
        detected_s: Robot clock of the sample at which the guard tripped.
    """

    stamp_s: float
    position_B_P: Array
    quat_B_P: Array
    force_B: Array
    peak_N: float
    detected_s: float


class ContactGuard:
    """Detect a contact at the tip during one guarded move; call it with every observation, in order.

    The hand keeps its orientation during a guarded move; the newest one of each block is used.

    Args:
        baseline: Contact-free wrench, measured at rest just before the move.
        approach_B: (3,) direction of motion in B; None: a force in any direction counts (arcs).
        tip_P_m: (3,) tip in P.
        pose_E_P: P in E (S = E).
        params: Thresholds.
        inertial: Returns the inertial wrench (n, 6) in S of a block's n samples, e.g. `MeasuredInertia`; None: no
            compensation.

    Raises:
        ParamError: A zero approach or a wrong shape.
    """

    def __init__(
        self,
        baseline: Baseline,
        approach_B: Array | None,
        tip_P_m: Array,
        pose_E_P: Pose,
        params: GuardParams,
        inertial: Callable[[Observation], Array] | None = None,
    ) -> None:
        self.params = params
        self._inertial = inertial
        self._zero = baseline.median
        self._fusion = TipFusion.for_tip(tip_P_m, pose_E_P, baseline.sd)
        self._R_P_E = pose_E_P.rotation.T
        self._R_B_S: Array = np.eye(3)
        self._history: deque[tuple[Observation, Array]] = deque(maxlen=HISTORY_BLOCKS)
        self._approach_B, self._directed = ANY_DIRECTION, approach_B is not None
        if approach_B is not None:
            a = frozen_array("approach_B", approach_B, (3,))
            norm = float(np.linalg.norm(a))
            if norm < 1e-9:
                raise ParamError("approach_B", a.tolist(), "a direction of some length, or None")
            self._approach_B = a / norm
        slow = replace(
            params,
            directional_N=params.sustained_N,
            total_N=params.sustained_N,
            moment_Nm=params.moment_Nm * params.sustained_N / params.total_N,
            cutoff_Hz=params.sustained_Hz,
            sigmas=SUSTAINED_SIGMAS_RATIO * params.sigmas,
        )
        filters = [LowPass(6, p.cutoff_Hz, p.rate_Hz) for p in (params, slow)]
        limits = [
            (p.directional_N, p.total_N, p.moment_Nm, p.sigmas * math.sqrt(f.noise_gain**2 + baseline.median_variance))
            for p, f in zip((params, slow), filters, strict=True)
        ]
        self._filters, self._limits = np.array([f.coefficients for f in filters]), np.array(limits)
        self._states, self._above = np.zeros((len(filters), 2, 6)), np.zeros(len(filters), dtype=np.int64)
        self._smooth: Array = np.zeros(6)
        self._onset: Onset | None = None

    def __call__(self, observation: Observation) -> Onset | None:
        """Return the onset once one of the rules has tripped (always the same one), else None."""
        if self._onset is not None:
            return self._onset
        residual = np.zeros(observation.wrench_S.shape)
        inertial = residual if self._inertial is None else self._inertial(observation)
        self._R_B_S = quat_to_matrix(observation.quat_B_P[-1]) @ self._R_P_E
        approach_S = self._approach_B @ self._R_B_S if self._directed else ANY_DIRECTION
        trip = _tripped(
            observation.wrench_S, self._zero, inertial, approach_S, self._directed, self._fusion.gain,
            self._fusion.covariance, self._filters, self._states, self._limits, self.params.consecutive, self._above,
            residual, self._smooth,
        )  # fmt: skip
        self._history.append((observation, residual))
        if trip >= 0:
            self._onset = self._date(observation, trip, self._fusion.gain @ self._smooth)
        return self._onset

    def standing(self, observation: Observation) -> Onset | None:
        """Evaluate an observation during a pause; the baseline follows the sensor's drift."""
        onset = self(observation)
        if onset is None:
            share = len(observation.stamp_s) / (DRIFT_S * self.params.rate_Hz)
            self._zero = self._zero + share * self._history[-1][1].mean(axis=0)
        return onset

    def force_B_N(self, observation: Observation) -> Array:
        """Return the mean force (3,) on the tip in B over a block at rest, unfiltered."""
        rotation = quat_to_matrix(observation.quat_B_P[-1]) @ self._R_P_E
        return np.asarray(rotation @ (self._fusion.gain @ (observation.wrench_S.mean(axis=0) - self._zero)))

    def _date(self, o: Observation, trip: int, force_S: Array) -> Onset:
        stamps = np.concatenate([b.stamp_s for b, _ in self._history])
        positions = np.concatenate([b.position_B_P for b, _ in self._history])
        quats = np.concatenate([b.quat_B_P for b, _ in self._history])
        raw = self._fusion(np.concatenate([r for _, r in self._history]))
        direction = force_S / np.linalg.norm(force_S)
        if self._directed:
            direction = -(self._approach_B @ self._R_B_S)
        at = onset_index(raw @ direction, len(stamps) - len(o.stamp_s) + trip, self._fusion.sd_along(direction))
        stamp = float(np.interp(at, np.arange(len(stamps)), stamps)) - self.params.latency_s
        stamp = max(stamp, float(stamps[0]))
        position = np.array([np.interp(stamp, stamps, positions[:, i]) for i in range(3)])
        return Onset(
            stamp_s=stamp,
            position_B_P=position,
            quat_B_P=quats[int(np.argmin(np.abs(stamps - stamp)))].copy(),
            force_B=self._R_B_S @ force_S,
            peak_N=float(np.sqrt(np.max(np.sum(raw**2, axis=1)))),
            detected_s=float(o.stamp_s[trip]),
        )


@compiled(
    "given f8[:, :]",
    "given f8[:]",
    "given f8[:, :]",
    "given f8[:]",
    "b1",
    "given f8[:, :]",
    "given f8[:, :]",
    "f8[:, ::1]",
    "f8[:, :, ::1]",
    "f8[:, ::1]",
    "i8",
    "i8[::1]",
    "f8[:, ::1]",
    "f8[::1]",
)
def _tripped(
    wrench: Array,
    zero: Array,
    inertial: Array,
    approach: Array,
    directed: bool,
    gain: Array,
    covariance: Array,
    filters: Array,
    states: Array,
    limits: Array,
    consecutive: int,
    above: npt.NDArray[np.int64],
    residual: Array,
    smooth: Array,
) -> int:
    """Return the sample at which the first rule trips, or -1.

    Args:
        wrench: (n, 6) sensed in S.
        zero, inertial: (6,), (n, 6) what it shows without contact.
        approach: (3,) direction of motion in S; only used if `directed`.
        directed: An opposing force is required.
        gain, covariance: (3, 6), (3, 3) of `TipFusion`.
        filters: (rules, 5) coefficients of `butterworth`.
        states: (rules, 2, 6) of the filters; updated.
        limits: (rules, 4) opposing force N, total force N, moment Nm, and standard deviations of the filtered force.
        consecutive: Number of consecutive samples that trip a rule.
        above: (rules,) number of the newest samples in a row that satisfy it; updated.
        residual: (n, 6) filled with `wrench` without what it shows without contact.
        smooth: (6,) filled with the filtered residual at the sample.
    """
    sd_2, force = 0.0, np.zeros(3)
    for j in range(3):
        for k in range(3):
            sd_2 += approach[j] * covariance[j, k] * approach[k]
    for i in range(len(wrench)):
        for k in range(6):
            residual[i, k] = wrench[i, k] - zero[k] - inertial[i, k]
    for rule in range(len(limits)):
        directional, total, moment, sigmas = limits[rule, 0], limits[rule, 1], limits[rule, 2], limits[rule, 3]
        b0, b1, b2, a1, a2 = filters[rule, 0], filters[rule, 1], filters[rule, 2], filters[rule, 3], filters[rule, 4]
        min_against = max(directional, sigmas * np.sqrt(sd_2))
        for i in range(len(wrench)):
            for k in range(6):  # as in `LowPass`
                smooth[k] = b0 * residual[i, k] + states[rule, 0, k]
                states[rule, 0, k] = b1 * residual[i, k] - a1 * smooth[k] + states[rule, 1, k]
                states[rule, 1, k] = b2 * residual[i, k] - a2 * smooth[k]
            square = against = variance = torque = 0.0
            for j in range(3):
                f = 0.0
                for k in range(6):
                    f += gain[j, k] * smooth[k]
                force[j] = f
                square += f * f
                against -= f * approach[j]
                torque += smooth[3 + j] ** 2
            for j in range(3):
                for k in range(3):
                    variance += force[j] * covariance[j, k] * force[k]
            # Multiplying both sides of the threshold by the norm avoids a division by a norm that may be zero.
            met = square > total**2 and square * square > sigmas**2 * variance
            if directed:
                met = against > min_against and (met or torque > moment**2)
            above[rule] = above[rule] + 1 if met else 0
            if above[rule] >= consecutive:
                return i
    return -1
