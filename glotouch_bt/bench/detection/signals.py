"""Synthetic wrist signals of guarded moves, without a simulator: hours of signal in seconds.

Modelled: white noise, drift, latency, and the inertia of the carried tool, whose true mass and centre of mass differ
from the configured ones by the condition's payload error. Not modelled: vibration of the arm and its servo; the
simulated half of the study has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glotouch_bt.motion import rest_to_rest
from glotouch_bt.perception.touch import ContactGuard, GuardParams, MeasuredInertia, Onset, Payload, fit_baseline
from glotouch_bt.robot import Array, Conditions, GripperState, Observation, Pose
from glotouch_bt.skill.probing import GUARDED_ACCELERATION_M_S2, GUARDED_JERK_M_S3

RATE_HZ, PERIOD_S = 1000.0, 0.01
REST = 120
"""Number of samples at rest before the move, for the baseline."""
R_B_S = np.diag([1.0, -1.0, -1.0])
"""Rotation of the sensor frame when the hand points down."""

MoveKind = Literal["sweep", "step", "down"]
"""`sweep`: sideways, forces against the motion count. `step`: sideways, any force counts. `down`: along the probe."""


@dataclass(frozen=True)
class Hand:
    """The hand and tool that the signals belong to.

    Attributes:
        carried: Configured mass and centre of mass below the wrist.
        tip_P_m: (3,) the ball's centre in P.
        pose_E_P: P in E.
    """

    carried: Payload
    tip_P_m: Array
    pose_E_P: Pose

    @property
    def tip_S_m(self) -> Array:
        """(3,) the ball's centre in S."""
        return self.pose_E_P.apply(self.tip_P_m)


@dataclass(frozen=True)
class FreeMove:
    """One straight move from rest to rest.

    Attributes:
        kind: Kind of move, which selects the guard.
        length_m, speed_m_s: Length and speed; acceleration and jerk are those of guarded moves.
        direction_B: (3,) unit.
    """

    kind: MoveKind
    length_m: float
    speed_m_s: float
    direction_B: Array


def wrong(carried: Payload, conditions: Conditions, rng: np.random.Generator) -> Payload:
    """Draw the true payload for a configured one."""
    mass = carried.mass_kg * (1.0 + conditions.payload_mass_error * rng.standard_normal())
    return Payload(mass, carried.com_S_m + conditions.payload_com_error_m * rng.standard_normal(3))


class Wrist:
    """Wrist sensor of one trial; drift and true payload persist over its moves.

    Args:
        hand: As configured.
        conditions: Disturbances.
        compensate: Subtract the inertial wrench of the measured motion, as the prober does.
        rng: Random stream of this trial.
    """

    def __init__(self, hand: Hand, conditions: Conditions, rng: np.random.Generator, compensate: bool = True) -> None:
        self._hand, self._c, self._rng, self._compensate = hand, conditions, rng, compensate
        self._true = wrong(hand.carried, conditions, rng)
        self._sd = np.array([conditions.force_noise_sd_N] * 3 + [conditions.torque_noise_sd_Nm] * 3)
        self._drift_sd = conditions.force_drift_N_per_sqrt_min * np.sqrt(1.0 / RATE_HZ / 60.0)

    def listen(self, move: FreeMove, touch_B_N: Array | None = None) -> tuple[Onset | None, float]:
        """Simulate one guarded move; return its onset and the guarded time, s.

        Args:
            move: The move.
            touch_B_N: (k, 3) force on the ball in B from the first sample of the move, or None; truncated to the move.
        """
        limits = GUARDED_ACCELERATION_M_S2, GUARDED_JERK_M_S3
        profile = rest_to_rest(move.length_m, move.speed_m_s, *limits, PERIOD_S)
        n = round(len(profile.a) * PERIOD_S * RATE_HZ)
        ends = np.arange(len(profile.a) + 1) * PERIOD_S * RATE_HZ - 1
        along = np.interp(np.arange(n), ends, np.concatenate([[0.0], profile.a]))
        direction_S = R_B_S.T @ move.direction_B
        clean = along[:, None] * self._true.wrench_S(direction_S)
        if touch_B_N is not None:
            force_S = np.zeros((n, 3))
            k = min(n, len(touch_B_N))
            force_S[:k] = touch_B_N[:k] @ R_B_S
            clean[:, :3] += force_S
            clean[:, 3:] += np.cross(self._hand.tip_S_m, force_S)
        wrench = self._sensed(np.vstack([np.zeros((REST, 6)), clean]))
        baseline = fit_baseline(wrench[:REST])
        hand, params = self._hand, GuardParams()
        inertia = MeasuredInertia(hand.carried, hand.pose_E_P, params.latency_s) if self._compensate else None
        direction_B = None if move.kind == "step" else move.direction_B
        guard = ContactGuard(baseline, direction_B, hand.tip_P_m, hand.pose_E_P, params, inertia)
        return guard(_block(wrench[REST:], move, along)), n / RATE_HZ

    def _sensed(self, true: Array) -> Array:
        """Return the reported wrenches (n, 6) for true wrenches (n, 6)."""
        noise = self._rng.standard_normal((len(true), 6)) * self._sd
        noise[:, :3] += np.cumsum(self._rng.standard_normal((len(true), 3)) * self._drift_sd, axis=0)
        return np.asarray(_late(true, self._c.wrench_latency_s) + noise)


def _late(values: Array, latency_s: float) -> Array:
    """Delay a series (n, ...) by a whole number of samples, repeating its first value."""
    k = round(latency_s * RATE_HZ)
    return values if k == 0 else np.concatenate([np.repeat(values[:1], k, axis=0), values[:-k]])


def _block(wrench: Array, move: FreeMove, along_m_s2: Array) -> Observation:
    """Pack all samples of the move into one block."""
    n = len(wrench)
    stamps = np.arange(1, n + 1) / RATE_HZ
    way = np.cumsum(np.cumsum(along_m_s2)) / RATE_HZ**2
    idle = np.zeros((n, 7))
    return Observation(
        stamp_s=stamps,
        q=idle,
        dq=idle,
        position_B_P=way[:, None] * move.direction_B,
        quat_B_P=np.tile([0.0, 1.0, 0.0, 0.0], (n, 1)),
        wrench_S=wrench,
        gripper=GripperState(0.0, 0.016, 60.0, False),
    )
