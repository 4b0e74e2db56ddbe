"""What hangs in the hand, by the tared wrist."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Arm, Motion

GRAVITY_M_S2 = 9.81
STAND_S, WEIGH_S = 0.1, 0.25
"""The hand stands still before it weighs: the end of a stop is felt as a force, too."""


@dataclass(frozen=True)
class Weighed:
    """What hangs in the hand beyond what was tared.

    Attributes:
        weight_N: From the force straight down.
        moment_Nm: Of the moment about the sensor, the part about level axes: weight times how far aside it hangs.
    """

    weight_N: float
    moment_Nm: float


def weigh(arm: Arm) -> Motion[Weighed]:
    """Stand still, and feel what hangs in the hand; the tare was taken with the hand upright."""
    yield from arm.hold(STAND_S)
    blocks = yield from arm.hold(WEIGH_S)
    wrench_S = np.concatenate([b.wrench_S for b in blocks]).mean(axis=0)
    rotation = arm.pose_B_P.rotation
    force_B, moment_B = rotation @ wrench_S[:3], rotation @ wrench_S[3:]
    return Weighed(-float(force_B[2]), float(np.hypot(moment_B[0], moment_B[1])))


def weigh_N(arm: Arm) -> Motion[float]:
    """Weight in the hand, N, from the force straight down; the tare was taken with the hand empty and upright."""
    return (yield from weigh(arm)).weight_N
