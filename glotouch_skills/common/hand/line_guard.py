"""A guard for straight moves that must neither press nor leave their line: into and out of the holder, and upwards."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.motion import Arm, Motion, MoveResult
from glotouch_bt.robot import Array, GuardTripped, Observation
from glotouch_skills.common.hand.weighing import STAND_S

MAX_OFF_LINE_M = 0.0015
"""Distance from the line that ends the move. The holder's slot is 4 mm wider than the shaft on each side, and a
straying arm needs half of that to stop."""
MAX_FARTHER_M = 0.0005
"""A hand that starts farther off its line than `MAX_OFF_LINE_M` may go this much farther."""
UP_B = np.array([0.0, 0.0, 1.0])
"""Upwards in B."""
DOWN_B = np.array([0.0, 0.0, -1.0])
"""Downwards in B."""
ARM_COMPLIANCE_M_N = 1.5e-4
"""Largest compliance of the servoed arm (simulated). A hand farther off its line than this explains does not follow."""


@dataclass(frozen=True)
class Pressed:
    """The move ended because something pressed.

    Attributes:
        force_N: Change of the force since rest.
    """

    force_N: float

    def __str__(self) -> str:
        return f"{self.force_N:.0f} N more than at rest"


@dataclass(frozen=True)
class Strayed:
    """The move ended because the hand left its line.

    Attributes:
        off_m: Distance from the line.
        max_off_m: Largest allowed distance.
        force_N: Change of the force since rest.
        stamp_s: Robot clock.
    """

    off_m: float
    max_off_m: float
    force_N: float
    stamp_s: float

    def __str__(self) -> str:
        off, most = 1e3 * self.off_m, 1e3 * self.max_off_m
        return f"the hand is {off:.1f} mm beside its setpoint with {self.force_N:.0f} N on it, {most:.1f} are allowed"


@dataclass(frozen=True)
class StraightGuard:
    """Trip on a force, or on a distance from the commanded line, which the servo's lag along the line does not change.

    Attributes:
        free_S_N: (3,) force at rest, to compare each period's mean with.
        max_N: Largest change of the force.
        start_B_m: (3,) point of the commanded line.
        along_B: (3,) its direction.
        max_off_m: Largest distance of P from it.
    """

    free_S_N: Array
    max_N: float
    start_B_m: Array
    along_B: Array
    max_off_m: float

    def __call__(self, seen: Observation) -> Pressed | Strayed | None:
        """See `motion.Guard`."""
        force = float(np.linalg.norm(seen.wrench_S[:, :3].mean(axis=0) - self.free_S_N))
        if force > self.max_N:
            return Pressed(force)
        off = self.off_m(seen)
        return Strayed(off, self.max_off_m, force, seen.now_s) if off > self.max_off_m else None

    def off_m(self, seen: Observation) -> float:
        """Return the distance of P from the line, newest sample."""
        way = seen.position_B_P[-1] - self.start_B_m
        return float(np.linalg.norm(way - (way @ self.along_B) * self.along_B))


def straight_guard(arm: Arm, along_B: Array, max_N: float) -> Motion[StraightGuard]:
    """Measure the force at rest and return a guard for a move from here along `along_B` (3,)."""
    blocks = yield from arm.hold(STAND_S)
    free = np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0)
    unit = along_B / np.linalg.norm(along_B)
    guard = StraightGuard(free, max_N, arm.pose_B_P.position_m, unit, MAX_OFF_LINE_M)
    return replace(guard, max_off_m=max(MAX_OFF_LINE_M, guard.off_m(blocks[-1]) + MAX_FARTHER_M))


def describe_stop(moved: MoveResult) -> str | None:
    """Return what ended a straight move early, in words, or None.

    Raises:
        GuardTripped: No force explains the distance from the line: the arm does not follow its setpoints, and no other
            move will help.
    """
    stop = moved.stop
    if isinstance(stop, Strayed) and stop.off_m > stop.force_N * ARM_COMPLIANCE_M_N + MAX_FARTHER_M:
        raise GuardTripped("following", str(stop), stop.off_m, stop.max_off_m, stop.stamp_s)
    return None if stop is None else f"after {moved.travelled_m * 1e3:.0f} mm {stop}"
