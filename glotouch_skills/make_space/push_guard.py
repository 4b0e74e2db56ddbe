"""What the wrist feels of a pushed object, and the guard that ends the push."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.robot import Array, Container, Observation
from glotouch_skills.common.hand import STAND_S
from glotouch_skills.common.planning import Push

REST_S = 0.1
"""Time at rest over which the place of the stopped fingers is averaged."""
STEADY_SHARE = 0.5
"""Share of the samples of the push, the last ones, whose mean resistance is the object's."""


TOUCHING_N = 0.3
"""Change of the force at rest that counts as a touch of the lowered fingers. The noise of its mean is 0.01 N; the drift
of `realistic` over ten seconds is 0.012 N. Fingers on a foot that the probe had passed over were pressed with 0.5 N."""


@dataclass(frozen=True)
class Felt:
    """Result of a push.

    Attributes:
        edge_m: Coordinate along the push, in K, of the fingers' pushing side at rest.
        pushed_m: Distance the object moved, from the expected contact on; not negative.
        resistance_N: Mean resistance of the second half of the push.
        peak_N: Largest resistance of one control period.
        stopped: The resistance ended the push.
    """

    edge_m: float
    pushed_m: float
    resistance_N: float
    peak_N: float
    stopped: bool


@dataclass
class PushGuard:
    """Trip when the resistance along the push passes a limit, and remember it.

    Attributes:
        arm: The arm.
        free_B_N: (3,) force on the hand without contact, written in B.
        along_B: (3,) direction of the push.
        max_N: Largest resistance of a control period.
        resistance_N: Mean resistance of each control period so far.
    """

    arm: Arm
    free_B_N: Array
    along_B: Array
    max_N: float
    resistance_N: list[float] = field(default_factory=list)

    def __call__(self, seen: Observation) -> str | None:
        """See `motion.Guard`."""
        force_B = self.arm.pose_B_P.rotation @ seen.wrench_S[:, :3].mean(axis=0)
        self.resistance_N.append(-float((force_B - self.free_B_N) @ self.along_B))
        tripped = not self.resistance_N[-1] <= self.max_N  # true for NaN, too
        return f"{self.resistance_N[-1]:.1f} N against the push" if tripped else None

    def at_rest(self, container: Container, push: Push, half_m: float, stopped: bool) -> Motion[Felt]:
        """Stand still and return what was felt.

        Args:
            container: Frame K.
            push: The push that has ended.
            half_m: Distance of the pushing side from P.
            stopped: This guard has tripped.
        """
        blocks = yield from self.arm.hold(REST_S)
        position_B = np.concatenate([b.position_B_P for b in blocks]).mean(axis=0)
        place_K = container.pose_B_K.inverse().apply(position_B)[:2]
        travelled = float((place_K - push.start_K_m) @ push.along_K)
        pushing = self.resistance_N[int(len(self.resistance_N) * (1.0 - STEADY_SHARE)) :]
        return Felt(
            edge_m=float(place_K @ push.along_K) + half_m,
            pushed_m=max(travelled - push.approach_m, 0.0),
            resistance_N=float(np.mean(pushing)) if pushing else 0.0,
            peak_N=max(self.resistance_N, default=0.0),
            stopped=stopped,
        )


def push_guard(arm: Arm, along_B: Array, max_N: float) -> Motion[PushGuard]:
    """Measure the force on the free hand and return a guard for a push along `along_B` (3,), unit."""
    return PushGuard(arm, (yield from standing_force_B_N(arm)), along_B, max_N)


def standing_force_B_N(arm: Arm) -> Motion[Array]:
    """Come to rest and return the mean force (3,) on the hand, written in B."""
    yield from arm.hold(STAND_S)
    blocks = yield from arm.hold(STAND_S)
    return np.asarray(arm.pose_B_P.rotation @ np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0))
