"""Weigh what hangs in the hand, by the tared wrist."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.motion import Arm, Motion

GRAVITY_M_S2 = 9.81
"""Standard gravity, rounded."""
STAND_S = 0.1
"""Stand still for this long first: the end of a stop is felt as a force, too."""
WEIGH_S = 0.25
"""Average the wrench over this time."""


@dataclass(frozen=True)
class Weighed:
    """Load in the hand beyond what was tared.

    Attributes:
        weight_N: Force straight down.
        moment_Nm: Moment about the sensor's horizontal axes: weight times horizontal offset.
    """

    weight_N: float
    moment_Nm: float


def weigh(arm: Arm) -> Motion[Weighed]:
    """Stand still and measure the load in the hand; the tare was taken with the hand upright."""
    yield from arm.hold(STAND_S)
    blocks = yield from arm.hold(WEIGH_S)
    wrench_S = np.concatenate([b.wrench_S for b in blocks]).mean(axis=0)
    rotation = arm.pose_B_P.rotation
    force_B, moment_B = rotation @ wrench_S[:3], rotation @ wrench_S[3:]
    return Weighed(-float(force_B[2]), float(np.hypot(moment_B[0], moment_B[1])))


def weigh_N(arm: Arm) -> Motion[float]:
    """Return the weight in the hand, N; the tare was taken with the hand empty and upright."""
    return (yield from weigh(arm)).weight_N
