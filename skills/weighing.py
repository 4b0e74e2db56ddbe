"""What hangs in the hand, by the tared wrist."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Arm, Motion

GRAVITY_M_S2 = 9.81
STAND_S, WEIGH_S = 0.1, 0.25
"""The hand stands still before it weighs: the end of a stop is felt as a force, too."""


def weigh_N(arm: Arm) -> Motion[float]:
    """Weight in the hand, N, from the force straight down; the tare was taken with the hand empty and upright."""
    yield from arm.hold(STAND_S)
    blocks = yield from arm.hold(WEIGH_S)
    force_S = np.concatenate([b.wrench_S[:, :3] for b in blocks]).mean(axis=0)
    return -float((arm.pose_B_P.rotation @ force_S)[2])
