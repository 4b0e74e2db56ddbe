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
        self._approach_B: Array | None = None
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
        self._rules = tuple(_SoftRule(p, baseline, self._fusion) for p in (params, slow))
        self._onset: Onset | None = None

    def __call__(self, observation: Observation) -> Onset | None:
        """Return the onset once one of the rules has tripped (always the same one), else None."""
        if self._onset is not None:
            return self._onset
        residual = observation.wrench_S - self._zero
        if self._inertial is not None:
            residual -= self._inertial(observation)
        self._history.append((observation, residual))
        self._R_B_S = quat_to_matrix(observation.quat_B_P[-1]) @ self._R_P_E
        approach_S = None if self._approach_B is None else self._approach_B @ self._R_B_S
        for rule in self._rules:
            tripped = rule.trip(residual, approach_S)
            if tripped is not None:
                self._onset = self._date(observation, *tripped)
                break
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
        if self._approach_B is not None:
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


@compiled("f8[:, ::1]", "given f8[:, :]", "given f8[:, :]", "f8[::1]", "b1", "f8[::1]", "i8", "i8[::1]")
def _tripped(
    smooth: Array,
    gain: Array,
    covariance: Array,
    approach: Array,
    directed: bool,
    limits: Array,
    consecutive: int,
    above: npt.NDArray[np.int64],
) -> int:
    """Return the sample at which the rule trips, or -1.

    Args:
        smooth: (n, 6) filtered residual wrench in S.
        gain, covariance: (3, 6), (3, 3) of `TipFusion`.
        approach: (3,) direction of motion in S; only used if `directed`.
        directed: An opposing force is required.
        limits: (4,) opposing force N, total force N, moment Nm, and standard deviations of the filtered force.
        consecutive: Number of consecutive samples that trip the rule.
        above: (1,) number of the newest samples in a row that satisfy it; updated.
    """
    directional, total, moment, sigmas = limits[0], limits[1], limits[2], limits[3]
    sd = 0.0
    for j in range(3):
        for k in range(3):
            sd += approach[j] * covariance[j, k] * approach[k]
    min_against = max(directional, sigmas * np.sqrt(sd))
    force = np.zeros(3)
    for i in range(len(smooth)):
        square = against = variance = torque = 0.0
        for j in range(3):
            f = 0.0
            for k in range(6):
                f += gain[j, k] * smooth[i, k]
            force[j] = f
            square += f * f
            against -= f * approach[j]
            torque += smooth[i, 3 + j] ** 2
        for j in range(3):
            for k in range(3):
                variance += force[j] * covariance[j, k] * force[k]
        # Multiplying both sides of the threshold by the norm avoids a division by a norm that may be zero.
        met = square > total**2 and square * square > sigmas**2 * variance
        if directed:
            met = against > min_against and (met or torque > moment**2)
        above[0] = above[0] + 1 if met else 0
        if above[0] >= consecutive:
            return i
    return -1


class _SoftRule:
    """The rule for one filter and its thresholds, over one move."""

    def __init__(self, params: GuardParams, baseline: Baseline, fusion: TipFusion) -> None:
        self._fusion, self._consecutive = fusion, params.consecutive
        self._low_pass = LowPass(6, params.cutoff_Hz, params.rate_Hz)
        sigmas = params.sigmas * math.sqrt(self._low_pass.noise_gain**2 + baseline.median_variance)
        self._limits = np.array([params.directional_N, params.total_N, params.moment_Nm, sigmas])
        self._above = np.zeros(1, dtype=np.int64)

    def trip(self, residual_S: Array, approach_S: Array | None) -> tuple[int, Array] | None:
        """Return the sample of this block (n, 6) at which the rule trips and the filtered force (3,) there, or None."""
        smooth, fusion = self._low_pass(residual_S), self._fusion
        approach, directed = (ANY_DIRECTION, False) if approach_S is None else (approach_S, True)
        i = _tripped(
            smooth, fusion.gain, fusion.covariance, approach, directed, self._limits, self._consecutive, self._above
        )
        return None if i < 0 else (i, fusion.gain @ smooth[i])
