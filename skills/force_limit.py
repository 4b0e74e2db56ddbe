"""A guard for moves that must not press: into the probe's holder and out of it, and up from wherever the hand is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.robot import Array, Observation
from skills.weighing import STAND_S


@dataclass(frozen=True)
class Pressed:
    """What ended a move: the change of force, N."""

    force_N: float


@dataclass(frozen=True)
class ForceLimit:
    """A guard: a period's mean force differs from `free_S_N` (3,) by more than `most_N`."""

    free_S_N: Array
    most_N: float

    def __call__(self, seen: Observation) -> Pressed | None:
        """See `motion.Guard`."""
        force = float(np.linalg.norm(seen.wrench_S[:, :3].mean(axis=0) - self.free_S_N))
        return None if force <= self.most_N else Pressed(force)


def force_limit(arm: Arm, most_N: float) -> Motion[ForceLimit]:
    """Stand a moment, and take the force felt now as that of a free hand."""
    blocks = yield from arm.hold(STAND_S)
    return ForceLimit(np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0), most_N)
