"""Force of a pushed object on the hand, and the guard that ends the push.

A flat finger that pushes above the object's base carries a tipping moment by friction: the object pulls the finger
down where it would rise, and pushes it up. A large vertical share of the force shows that the object is about to topple
(Lynch and Mason, Stable pushing, 1996, for the plane; here in the vertical plane of the push).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.robot import Array, Observation
from glotouch_skills.common.hand import STAND_S, UP_B
from glotouch_skills.common.planning import Push

REST_S = 0.1
"""Time at rest over which the place of the stopped fingers is averaged."""
STEADY_SHARE = 0.5
"""Share of the samples of the push, the last ones, whose mean resistance is the object's."""


TIP_RATIO = 0.5
"""Upward force over resistance at which the object is about to topple. Of 13 pushes of standing objects
(`bench space`, realistic, seeds 56000-56003) without this rule, one of five above it toppled, and none of eight
below."""
TIP_S = 0.3
"""Time over which that ratio is averaged: 6 mm of the push."""
SEAT_M = 0.004
"""Way of the push before the ratio is judged: an object on an uneven base rocks first. With `TIP_S`, an object that is
touched at 36 mm tilts by 16 degrees at most, and falls back."""
STABLE = 0.6
"""Ratio of half the depth to the height from which an object does not topple: friction is at most 0.8, and the fingers
touch at three quarters of the height at most."""
MIN_TIP_N = 0.15
"""Least resistance for which the ratio is judged. The noise of a mean over `TIP_S` is 0.005 N; the wrist's offset in
motion is up to 0.1 N."""
MET_S = 0.1
"""Time over which the median resistance shows that the object was met. Source: ours."""
STARTED_M = 0.002
"""Way after which the hand no longer accelerates. Until then, its inertia alone is felt with up to 0.2 N."""
LEFT_FROM_M = 0.006
"""Distance before the stop from which the resistance shows whether the object is still there. Source: ours."""
LEFT_TO_M = 0.002
"""Distance before the stop at which that ends: nearer, the hand decelerates. Source: ours."""
LEFT_RATIO = 0.35
"""Resistance there over the median of the push below which the object has left the fingers: it rolled or toppled."""
TOUCHING_N = 0.3
"""Change of the force at rest that counts as a touch of the lowered fingers. The noise of its mean is 0.01 N; the drift
of `realistic` over ten seconds is 0.012 N. Fingers on a foot that the probe had passed over were pressed with 0.5 N."""


@dataclass(frozen=True)
class Felt:
    """Result of a push.

    Attributes:
        pushed_m: Distance the object moved: from where it was met, or else from where it was expected, to where the
            fingers stopped. Not negative.
        resistance_N: Mean resistance of the second half of the push.
        peak_N: Largest resistance of one control period.
        stopped: The resistance, or the tipping moment, ended the push.
        tipping: The object was about to topple.
        left: The object left the fingers before they stopped.
        early_m: Distance by which the object was met earlier than traced; NaN if it was not met.
    """

    pushed_m: float
    resistance_N: float
    peak_N: float
    stopped: bool
    tipping: bool = False
    left: bool = False
    early_m: float = math.nan


@dataclass
class PushGuard:
    """Trip when the resistance along the push passes a limit, or the object is about to topple; remember the forces.

    Attributes:
        arm: The arm.
        free_B_N: (3,) force on the hand without contact, written in B.
        along_B: (3,) direction of the push.
        max_N: Largest resistance of a control period.
        may_topple: The object is slim enough to topple.
        resistance_N: Mean resistance of each control period so far.
        lift_N: Mean upward force of each control period so far.
        along_m: Coordinate of P along the push in each of them.
        tipping: It tripped because the object was about to topple.
    """

    arm: Arm
    free_B_N: Array
    along_B: Array
    max_N: float
    may_topple: bool = True
    resistance_N: list[float] = field(default_factory=list)
    lift_N: list[float] = field(default_factory=list)
    along_m: list[float] = field(default_factory=list)
    tipping: bool = False

    def __call__(self, seen: Observation) -> str | None:
        """See `motion.Guard`."""
        force_B = self.arm.rotation_B_S @ seen.wrench_S[:, :3].mean(axis=0)
        change_B = force_B - self.free_B_N
        self.resistance_N.append(-float(change_B @ self.along_B))
        self.lift_N.append(float(change_B @ UP_B))
        self.along_m.append(float(seen.pose_B_P.position_m @ self.along_B))
        if not self.resistance_N[-1] <= self.max_N:  # true for NaN, too
            return f"{self.resistance_N[-1]:.1f} N against the push"
        self.tipping = self.may_topple and self._is_tipping()
        return "the object is about to topple" if self.tipping else None

    def _is_tipping(self) -> bool:
        """Return True if a large share of the force has pointed upwards for `TIP_S`, after the object has settled."""
        n = round(TIP_S / self.arm.period_s)
        if len(self.along_m) < n or not self.along_m[-n] >= self.met_m() + SEAT_M:
            return False
        resistance, lift = (float(np.mean(values[-n:])) for values in (self.resistance_N, self.lift_N))
        return resistance >= MIN_TIP_N and lift > TIP_RATIO * resistance

    def met_m(self) -> float:
        """Return the coordinate of P along the push where the object was met; NaN if it was not."""
        force, along, n = np.array(self.resistance_N), np.array(self.along_m), round(MET_S / self.arm.period_s)
        if len(force) < n:
            return math.nan
        felt = np.median(np.lib.stride_tricks.sliding_window_view(force, n), axis=1) >= MIN_TIP_N
        at_speed = along[: len(felt)] >= along[0] + STARTED_M
        met = np.flatnonzero(felt & (force[: len(felt)] >= MIN_TIP_N) & at_speed)
        return self.along_m[int(met[0])] if met.size else math.nan

    def has_left(self) -> bool:
        """Return True if the resistance had fallen before the fingers stopped."""
        force, to_go = np.array(self.resistance_N), max(self.along_m, default=0.0) - np.array(self.along_m)
        last = force[(to_go >= LEFT_TO_M) & (to_go <= LEFT_FROM_M)]
        felt = force[(force >= MIN_TIP_N) & (to_go > LEFT_FROM_M)]
        return bool(last.size and felt.size and last.mean() < LEFT_RATIO * np.median(felt))

    def at_rest(self, push: Push, stopped: bool) -> Motion[Felt]:
        """Stand still and return what was felt.

        Args:
            push: The push that has ended.
            stopped: This guard has tripped.
        """
        blocks = yield from self.arm.hold(REST_S)
        stop = float(np.concatenate([b.position_B_P for b in blocks]).mean(axis=0) @ self.along_B)
        expected = (self.along_m[0] if self.along_m else stop) + push.approach_m
        met = self.met_m()
        pushing = self.resistance_N[int(len(self.resistance_N) * (1.0 - STEADY_SHARE)) :]
        return Felt(
            pushed_m=max(stop - (expected if math.isnan(met) else met), 0.0),
            resistance_N=float(np.mean(pushing)) if pushing else 0.0,
            peak_N=max(self.resistance_N, default=0.0),
            stopped=stopped,
            tipping=self.tipping,
            left=not stopped and self.has_left(),
            early_m=expected - met,
        )


def push_guard(arm: Arm, along_B: Array, max_N: float, may_topple: bool) -> Motion[PushGuard]:
    """Measure the force on the free hand and return a guard for a push along `along_B` (3,), unit."""
    return PushGuard(arm, (yield from standing_force_B_N(arm)), along_B, max_N, may_topple)


def standing_force_B_N(arm: Arm) -> Motion[Array]:
    """Come to rest and return the mean force (3,) on the hand, written in B."""
    yield from arm.hold(STAND_S)
    blocks = yield from arm.hold(STAND_S)
    return np.asarray(arm.rotation_B_S @ np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0))
