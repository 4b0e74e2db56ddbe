"""Lift the grasped object and check that it came along."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import weigh_N


class LiftParams(SkillParams):
    """Parameters of `lift`."""

    height_m: float = param("Height of the lift", unit="m", default=0.15, gt=0.0, le=0.3)
    speed_m_s: float = param("Lifting speed", unit="m/s", default=0.06, gt=0.0, le=0.2)
    min_weight_N: float = param(
        "Least weight of a lifted object", unit="N", default=0.3, ge=0.0, formerly="least_weight_N"
    )
    min_aperture_m: float = param(
        "Least aperture of jaws that hold something", unit="m", default=0.003, ge=0.0, formerly="least_aperture_m"
    )


class Lift(Skill):
    """Raise the hand and check weight and aperture at the top.

    SUCCESS: an object with weight hangs in the jaws, and the arm holds it up.
    """

    Params = LiftParams
    params: LiftParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"})}
    # `lost` is decided by weight and aperture: a light object may still be between the pads.
    FAILURE_STATES: ClassVar = {"hand": frozenset({"object", "empty"})}
    USES: ClassVar = frozenset({"arm"})

    LOST = Failure("lost", "the jaws are empty at the top", advice="grasp nearer to the centre of mass, or harder")
    FAILURES: ClassVar = (MOTION_REFUSED.with_meaning("the arm cannot be raised so far"),)

    grip_m = In(float, "aperture of the closed jaws")
    weight_N = Out(float, "weight in the hand, N", key="weight")

    def run(self) -> SkillRun:
        """See the class."""
        arm, p = self.context.arm, self.params
        yield from arm.shift(np.array([0.0, 0.0, p.height_m]), p.speed_m_s, check=False)
        weight = yield from weigh_N(arm)
        state = self.context.observation.gripper
        self.event("lift", weight_N=weight, aperture_m=state.aperture_m)
        if weight < p.min_weight_N or state.aperture_m < p.min_aperture_m:
            raise self.LOST(
                f"{weight:.2f} N hang in the hand and the jaws are {state.aperture_m * 1e3:.1f} mm apart",
                weight_N=weight,
                aperture_m=state.aperture_m,
            )
        self.weight_N = weight
