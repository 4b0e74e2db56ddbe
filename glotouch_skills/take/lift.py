"""Lift the grasped object and check that it came along."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import MIN_GRIP_M, feel_hold


class LiftParams(SkillParams):
    """Parameters of `lift`."""

    height_m: float = param("Height of the lift", unit="m", default=0.15, gt=0.0, le=0.3)
    speed_m_s: float = param("Lifting speed", unit="m/s", default=0.06, gt=0.0, le=0.2)
    min_weight_N: float = param("Least weight of a lifted object", unit="N", default=0.3, ge=0.0)
    min_aperture_m: float = param("Minimum aperture of jaws that hold something", unit="m", default=MIN_GRIP_M, ge=0.0)
    slip_m: float = param(
        "Largest change of the aperture since the jaws closed", unit="m", default=0.004, gt=0.0, le=0.02
    )
    look_s: float = param("Time for which gels and jaws are measured", unit="s", default=0.2, ge=0.05, le=2.0)


class Lift(Skill):
    """Raise the hand and check the hold at the top: by weight, by the jaws (aperture and force), and by the gels.

    No single witness is believed: a wrist may be off zero, and jaws may report what they were told. All must agree.
    Jaws that closed farther, with the object on both gels, hold one that turned between them: `grip_m` is written anew.

    SUCCESS: an object with weight hangs in the jaws, and the arm holds it up.
    """

    Params = LiftParams
    params: LiftParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"}), "wrist": frozenset({"tared"})}
    # `lost` if any witness says so: the object may still be between the pads.
    FAILURE_STATES: ClassVar = {"hand": frozenset({"object", "empty"})}
    USES: ClassVar = frozenset({"arm"})

    LOST = Failure(
        "lost",
        "not all of weight, jaws and gels show the object at the top",
        advice="grasp nearer to the centre of mass, or harder",
    )
    FAILURES: ClassVar = (MOTION_REFUSED.with_meaning("the arm cannot be raised so far"),)

    grip_m = In(float, "aperture of the closed jaws")
    held_m = Out(float, "aperture at the top", key="grip_m")
    weight_N = Out(float, "weight in the hand, N", key="weight", result=lambda w: f"weight in the hand {w:.2f} N")

    def run(self) -> SkillRun:
        """See the class."""
        arm, p = self.context.arm, self.params
        yield from arm.shift(np.array([0.0, 0.0, p.height_m]), p.speed_m_s, check=False)
        hold = yield from feel_hold(arm, self.grip_m, p.look_s)
        self.event("lift", **hold.as_dict())
        doubts = hold.doubts(p.min_weight_N, p.slip_m, p.min_aperture_m, may_turn=True)
        if doubts:
            raise self.LOST("; ".join(doubts), **hold.as_dict())
        self.held_m, self.weight_N = hold.aperture_m, hold.weight_N
