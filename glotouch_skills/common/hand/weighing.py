"""Weigh the load in the hand with the tared wrist, and check a hold by weight, jaws and gels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.perception.touch import patch_statistics
from glotouch_bt.robot import TactileFrame

GRAVITY_M_S2 = 9.81
"""Standard gravity, rounded."""
STAND_S = 0.1
"""Stand still for this long first: the end of a stop is felt as a force, too."""
WEIGH_S = 0.25
"""Average the wrench over this time."""
MIN_GRIP_N = 1.0
"""Minimum force of jaws that hold something. Source: ours; jaws at their target report none."""
MIN_GRIP_M = 0.003
"""Default minimum aperture of jaws that hold something. Source: ours."""
BOTH_GELS = 2
"""Number of gels that feel an object between the jaws."""


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
    rotation = arm.rotation_B_S
    force_B, moment_B = rotation @ wrench_S[:3], rotation @ wrench_S[3:]
    return Weighed(-float(force_B[2]), float(np.hypot(moment_B[0], moment_B[1])))


def weigh_N(arm: Arm) -> Motion[float]:
    """Return the weight in the hand, N; the tare was taken with the hand empty and upright."""
    return (yield from weigh(arm)).weight_N


@dataclass(frozen=True)
class Hold:
    """Hold of an object as wrist, jaws and gels show it.

    Attributes:
        weight_N: Weight in the hand.
        aperture_m: Median aperture of the jaws.
        moved_m: Change of the aperture since the jaws closed.
        jaw_N: Median force of one jaw.
        gels_touched: Number of touched gels; None without depth maps.
    """

    weight_N: float
    aperture_m: float
    moved_m: float
    jaw_N: float
    gels_touched: int | None

    def failed_checks(
        self, min_weight_N: float, slip_m: float, min_aperture_m: float = MIN_GRIP_M, *, may_turn: bool = False
    ) -> list[str]:
        """Return the failed checks of the hold, by wrist, jaws and gels.

        With `may_turn`, jaws that closed farther still hold what both gels feel: it turned between them.
        """
        found = []
        turned = may_turn and self.gels_touched == BOTH_GELS and self.moved_m < 0.0
        if not self.weight_N >= min_weight_N:
            found.append(f"{self.weight_N:.2f} N hang in the hand, at least {min_weight_N:.2f} N are expected")
        stayed = turned or abs(self.moved_m) <= slip_m
        if not (stayed and self.aperture_m >= min_aperture_m and self.jaw_N >= MIN_GRIP_N):
            moved, apart = self.moved_m * 1e3, self.aperture_m * 1e3
            found.append(f"the jaws moved by {moved:.1f} mm to {apart:.1f} mm and press with {self.jaw_N:.1f} N")
        if self.gels_touched == 0:
            found.append("neither gel is touched")
        return found

    def as_dict(self) -> dict[str, Any]:
        """Return it as the evidence of a failure, -1 gels without depth maps."""
        touched = -1 if self.gels_touched is None else self.gels_touched
        return {
            "weight_N": self.weight_N,
            "aperture_m": self.aperture_m,
            "moved_m": self.moved_m,
            "jaw_N": self.jaw_N,
            "gels_touched": touched,
        }


def feel_hold(arm: Arm, grip_m: float, measure_s: float) -> Motion[Hold]:
    """Stand still and measure the hold with wrist, jaws and gels.

    Args:
        arm: At rest, the object lifted.
        grip_m: Aperture when the jaws had closed.
        measure_s: Time for which jaws and gels are measured.
    """
    blocks = yield from arm.hold(measure_s, tactile=True)
    weight_N = yield from weigh_N(arm)
    apart = float(np.median([b.gripper.aperture_m for b in blocks]))
    jaw_N = float(np.median([b.gripper.force_N for b in blocks]))
    frames = [b.tactile for b in blocks if b.tactile is not None]
    return Hold(weight_N, apart, apart - grip_m, jaw_N, _touched(frames[-1]) if frames else None)


def _touched(frame: TactileFrame) -> int:
    """Return how many of the two gels are touched."""
    return sum(patch_statistics(d).valid for d in (frame.left_m, frame.right_m))
