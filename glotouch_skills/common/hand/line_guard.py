"""A guard for straight moves that may neither press nor stray: into the probe's holder and out of it, and any rise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from glotouch_bt.motion import Arm, Motion, MoveResult
from glotouch_bt.robot import Array, GuardTripped, Observation
from glotouch_skills.common.hand.weighing import STAND_S

ASTRAY_M, FARTHER_M = 0.0015, 0.0005
"""The slot of the probe's holder is 4 mm wider than the shaft to each side, and an arm that goes astray needs half of
that to stop. A hand that is so far beside its setpoint at the start may go so much farther."""
UP_B, DOWN_B = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
GIVES_M_N = 1.5e-4
"""The arm gives so much a newton at most (simulated). What is farther beside its setpoint does not follow."""


@dataclass(frozen=True)
class Pressed:
    """The move ended because something pressed.

    Attributes:
        force_N: How much more than at rest.
    """

    force_N: float

    def __str__(self) -> str:
        return f"{self.force_N:.0f} N more than at rest"


@dataclass(frozen=True)
class Strayed:
    """The move ended because the hand left its way.

    Attributes:
        off_m: How far beside the line it is; max_off_m: how far it may be.
        force_N: How much more than at rest was felt.
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
    """Trips on a force, and on a distance from the commanded line: that is free of the servo's lag along it.

    Attributes:
        free_S_N: (3,) force at rest; a period's mean is compared with it.
        max_N: Largest difference.
        start_B_m, along_B: (3,) each, a point of the commanded line and its direction.
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
        """How far P is beside the line, newest sample."""
        way = seen.position_B_P[-1] - self.start_B_m
        return float(np.linalg.norm(way - (way @ self.along_B) * self.along_B))


def straight_guard(arm: Arm, along_B: Array, max_N: float) -> Motion[StraightGuard]:
    """Stand a moment and take what is felt now as a free hand's force; for a move from here along `along_B` (3,)."""
    blocks = yield from arm.hold(STAND_S)
    free = np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0)
    unit = along_B / np.linalg.norm(along_B)
    guard = StraightGuard(free, max_N, arm.pose_B_P.position_m, unit, ASTRAY_M)
    return replace(guard, max_off_m=max(ASTRAY_M, guard.off_m(blocks[-1]) + FARTHER_M))


def why_stopped(moved: MoveResult) -> str | None:
    """What ended a straight move before its end, in words; None: nothing did.

    Raises:
        GuardTripped: The hand is where no force can have pushed it: the arm does not follow its setpoints, and no other
            move will help.
    """
    stop = moved.stop
    if isinstance(stop, Strayed) and stop.off_m > stop.force_N * GIVES_M_N + FARTHER_M:
        raise GuardTripped("following", str(stop), stop.off_m, stop.max_off_m, stop.stamp_s)
    return None if stop is None else f"after {moved.travelled_m * 1e3:.0f} mm {stop}"
