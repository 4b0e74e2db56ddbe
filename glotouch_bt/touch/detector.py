"""The contact guard: soft thresholds that end a guarded move, and the hard stop beside it (paper III-A).

Signal: LPF(wrench - baseline), fused to a force at the tip. The soft rule needs the force that opposes the motion AND
the total force (or the moment) above their thresholds for N samples running; the hard rule trips on one sample.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array, Observation, ParamError, Pose
from glotouch_bt.robot.geometry import frozen_array, quat_to_matrix
from glotouch_bt.touch.baseline import Baseline
from glotouch_bt.touch.filtering import LowPass
from glotouch_bt.touch.fusion import TipFusion
from glotouch_bt.touch.onset import onset_index

HISTORY_BLOCKS = 10
"""Blocks kept for dating an onset: 100 ms at 100 Hz, of which the last third may belong to the contact."""


@dataclass(frozen=True, kw_only=True)
class GuardParams:
    """Thresholds of the contact guard and of the hard stop.

    Attributes:
        directional_N: Tip force against the motion that counts as touch. Source: 0.10-0.15 N is the usable range
            measured with fused force and torque; free motion at 0.3 m/s2 stays below 0.08 N.
        total_N: Norm of the tip force that must go with it. Source: as above.
        moment_Nm: Moment at the sensor that may stand in for the total force: `total_N` on a 0.34 m lever.
        consecutive: Samples in a row. Source: 3 at 1 kHz, one tenth of the filter's rise time: outliers only.
        sigmas: No threshold is ever below this many standard deviations of the filtered estimate in its direction, so
            that a noisy sensor does not trip by itself (5.5: one false alarm in hours).
        cutoff_Hz, rate_Hz: Low-pass and sampling rate. Source: 15-60 Hz change the result by < 0.2 mm.
        latency_s: Age of a wrench sample when it arrives. Source: the wrist sensor's declared latency.
        hard_force_N, hard_torque_Nm: Absolute limits of the tared wrench. Source: `robot.Limits`.
        hard_residual_N, hard_residual_Nm: Limits of the wrench minus its baseline: below what makes the grasped probe
            slip (12.8 N measured at 60 N grip), on the same lever for the torque.
    """

    directional_N: float = 0.15
    total_N: float = 0.15
    moment_Nm: float = 0.05
    consecutive: int = 3
    sigmas: float = 5.5
    cutoff_Hz: float = 30.0
    rate_Hz: float = 1000.0
    latency_s: float = 0.003
    hard_force_N: float = 30.0
    hard_torque_Nm: float = 10.2
    hard_residual_N: float = 20.0
    hard_residual_Nm: float = 6.8

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            least = 0.0 if f.name == "latency_s" else math.ulp(0.0)
            if not (math.isfinite(value) and value >= least):
                raise ParamError(f.name, value, "finite and positive (latency_s may be 0)")
        if self.consecutive != int(self.consecutive) or self.consecutive < 1:
            raise ParamError("consecutive", self.consecutive, "a whole number >= 1")
        if max(self.directional_N, self.total_N) >= min(self.hard_force_N, self.hard_residual_N):
            raise ParamError("directional_N, total_N", max(self.directional_N, self.total_N), "below the hard limits")
        if self.cutoff_Hz >= 0.5 * self.rate_Hz:
            raise ParamError("cutoff_Hz", self.cutoff_Hz, "below half of rate_Hz")


@dataclass(frozen=True)
class Onset:
    """The beginning of a contact.

    Attributes:
        stamp_s: Robot clock when the contact began (sensor latency removed).
        position_B_P: (3,) pads' mid-point in B then.
        quat_B_P: (4,) its orientation then.
        force_B: (3,) filtered force on the tip when the guard tripped, in B.
        peak_N: Largest unfiltered tip force seen up to the end of that block.
        detected_s: Robot clock of the sample at which the guard tripped.
    """

    stamp_s: float
    position_B_P: Array
    quat_B_P: Array
    force_B: Array
    peak_N: float
    detected_s: float


class ContactGuard:
    """Listens for a contact at the tip during one guarded move; call it with every observation, in order.

    The hand keeps its orientation during a guarded move; the newest one of each block is used.

    Args:
        baseline: The wrench that means "nothing touched", taken at rest just before the move.
        approach_B: (3,) direction of the motion in B, or None: a force in any direction counts (arcs).
        tip_P_m: (3,) the tip in P.
        pose_E_P: P in E (S = E).
        params: Thresholds.

    Raises:
        ParamError: An approach of no length or a wrong shape.
    """

    def __init__(
        self, baseline: Baseline, approach_B: Array | None, tip_P_m: Array, pose_E_P: Pose, params: GuardParams
    ) -> None:
        self.params = params
        self._baseline = baseline
        self._fusion = TipFusion.for_tip(tip_P_m, pose_E_P, baseline.sd)
        self._R_P_E = pose_E_P.rotation.T
        self._low_pass = LowPass(6, params.cutoff_Hz, params.rate_Hz)
        self._gain = self._fusion.gain
        self._sigmas = params.sigmas * self._low_pass.noise_gain
        self._R_B_S: Array = np.eye(3)
        self._history: deque[tuple[Observation, Array]] = deque(maxlen=HISTORY_BLOCKS)
        self._approach_B: Array | None = None
        if approach_B is not None:
            a = frozen_array("approach_B", approach_B, (3,))
            norm = float(np.linalg.norm(a))
            if norm < 1e-9:
                raise ParamError("approach_B", a.tolist(), "a direction of some length, or None")
            self._approach_B = a / norm
        self._above = np.zeros(params.consecutive - 1, dtype=np.int64)
        self._onset: Onset | None = None

    def __call__(self, observation: Observation) -> Onset | None:
        """The onset once the soft rule has tripped (the same one ever after), else None."""
        if self._onset is not None:
            return self._onset
        residual = observation.wrench_S - self._baseline.median
        smooth = self._low_pass(residual)
        self._history.append((observation, residual))
        force = smooth @ self._gain.T
        self._R_B_S = quat_to_matrix(observation.quat_B_P[-1]) @ self._R_P_E
        above = self._soft_rule(force, smooth[:, 3:])
        if above is None:
            if not np.count_nonzero(self._above):
                return None
            above = np.zeros(len(force), dtype=np.int64)
        carried = np.concatenate([self._above, above])
        n = self.params.consecutive
        self._above = carried[len(carried) - n + 1 :]
        if not above.any():
            return None
        tripped = np.nonzero(np.convolve(carried, np.ones(n, np.int64), "valid") == n)[0]
        if len(tripped):
            self._onset = self._date(observation, int(tripped[0]), force[tripped[0]])
        return self._onset

    def _soft_rule(self, force_S: Array, moment_S: Array) -> npt.NDArray[np.int64] | None:
        """(n,) 1 where a sample fulfils the soft rule; None if surely none does, told as early as it is clear."""
        p, opposing = self.params, None
        if self._approach_B is not None:
            approach_S = self._approach_B @ self._R_B_S
            against = force_S @ approach_S
            if not np.count_nonzero(against < -p.directional_N):
                return None
            opposing = against < -max(p.directional_N, self._sigmas * self._fusion.sd_along(approach_S))
            if not np.count_nonzero(opposing):
                return None
        square = (force_S * force_S).sum(axis=1)
        if opposing is None and not np.count_nonzero(square > p.total_N**2):
            return None
        # sigma along each sample's own direction times its norm: compares without dividing by a norm that may be zero
        variance = ((force_S @ self._fusion.covariance) * force_S).sum(axis=1)
        strong = (square > p.total_N**2) & (square * square > self._sigmas**2 * variance)
        if opposing is None:
            return np.asarray(strong, dtype=np.int64)
        moment = (moment_S * moment_S).sum(axis=1) > p.moment_Nm**2
        return np.asarray(opposing & (strong | moment), dtype=np.int64)

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


@dataclass(frozen=True)
class HardTrip:
    """A hard limit passed: which quantity (unit in its name), its value, its limit, and when."""

    quantity: str
    value: float
    limit: float
    stamp_s: float


class HardStop:
    """The envelope beside the soft rule: absolute and residual wrench norms, unfiltered, one sample is enough.

    Args:
        baseline: Subtracted for the residual limits.
        params: The four hard limits.
    """

    def __init__(self, baseline: Baseline, params: GuardParams) -> None:
        self._median = baseline.median
        self._limits = (
            ("force_N", params.hard_force_N),
            ("torque_Nm", params.hard_torque_Nm),
            ("residual_force_N", params.hard_residual_N),
            ("residual_torque_Nm", params.hard_residual_Nm),
        )
        force, torque, residual_force, residual_torque = (1.0 / limit for _, limit in self._limits)
        self._scale = np.array([force] * 3 + [torque] * 3)
        self._residual_scale = np.array([residual_force] * 3 + [residual_torque] * 3)

    def __call__(self, observation: Observation) -> HardTrip | None:
        """The earliest sample of the block beyond a limit, or None."""
        w = observation.wrench_S
        r = w - self._median
        whole, rest = (w * self._scale).ravel(), (r * self._residual_scale).ravel()
        if whole @ whole < 1.0 and rest @ rest < 1.0:  # not one sample can be beyond a limit, nor a NaN among them
            return None
        norms = [np.linalg.norm(v, axis=1) for v in (w[:, :3], w[:, 3:], r[:, :3], r[:, 3:])]
        trips = []
        for (quantity, limit), norm in zip(self._limits, norms, strict=True):
            # NOT below the limit: a NaN from the sensor trips as well
            bad = np.nonzero(~(norm <= limit))[0]
            if len(bad):
                trips.append(
                    (int(bad[0]), HardTrip(quantity, float(norm[bad[0]]), limit, float(observation.stamp_s[bad[0]])))
                )
        return min(trips, key=lambda t: t[0])[1] if trips else None


def reaction_direction(wrench_S: Array, baseline: Baseline, R_B_S: Array) -> Array:
    """Unit direction (3,) in B of the mean contact force over a settled block of wrenches (n, 6).

    Taken in the hold after a stop it is free of the impact's inertia (paper III-B, the direction r).

    Raises:
        ParamError: The mean force is no larger than its own uncertainty: there is no contact to speak of.
    """
    w = np.asarray(wrench_S, dtype=np.float64)
    mean = np.mean(w[:, :3], axis=0) - baseline.median[:3]
    norm = float(np.linalg.norm(mean))
    least = 3.0 * float(np.linalg.norm(baseline.sd[:3])) / math.sqrt(len(w))
    if norm <= max(least, 1e-9):
        raise ParamError("wrench_S", norm, f"a mean force above {least:.3g} N, else it has no direction")
    return np.asarray(R_B_S @ (mean / norm))


def settled(
    observations: Sequence[Observation],
    *,
    speed_m_s: float = 0.002,
    force_N: float = 0.1,
    torque_Nm: float = 0.02,
) -> bool:
    """True once wrench and twist have returned to a stable interval (paper III-A): judged over all given blocks.

    The tool must have moved slower than `speed_m_s`, and the mean wrench of the first and the last half may differ by
    no more than `force_N` and `torque_Nm` (means, so that white noise does not count). Fewer than two blocks: False.
    """
    if len(observations) < 2:
        return False
    stamps = np.concatenate([o.stamp_s for o in observations])
    positions = np.concatenate([o.position_B_P for o in observations])
    wrenches = np.concatenate([o.wrench_S for o in observations])
    span = float(stamps[-1] - stamps[0])
    if span <= 0 or float(np.max(np.linalg.norm(positions - positions[0], axis=1))) > speed_m_s * span:
        return False
    half = len(wrenches) // 2
    change = np.mean(wrenches[half:], axis=0) - np.mean(wrenches[:half], axis=0)
    return bool(np.linalg.norm(change[:3]) <= force_N and np.linalg.norm(change[3:]) <= torque_Nm)
