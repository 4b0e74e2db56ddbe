"""Check that the lifted object is held as it was taken, by two of weight, aperture and gels."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.perception.touch import patch_statistics
from glotouch_bt.robot import TactileFrame
from glotouch_bt.skill import UNCHANGED, Failure, In, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import weigh_N


class HoldCheckParams(SkillParams):
    """Parameters of `hold_check`."""

    look_s: float = param("Time for which gels and jaws are measured", unit="s", default=0.2, ge=0.05, le=2.0)
    weight_kept: float = param("Least share of the weight measured at the lift", default=0.6, gt=0.0, le=1.0)
    slip_m: float = param(
        "Largest change of the aperture since the jaws closed", unit="m", default=0.004, gt=0.0, le=0.02
    )


class HoldCheck(Skill):
    """Stand still with the lifted object and check that it is held as it was taken.

    Weight and aperture must be as before, and a gel must be touched. One of the three may be wrong (a drifting wrist, a
    stuck report, a frozen image), so two decide. A large change of the aperture is always a slip: the object then hangs
    by another place.

    SUCCESS: the object is held.
    """

    Params = HoldCheckParams
    params: HoldCheckParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"})}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "empty"})}
    USES: ClassVar = frozenset({"arm"})

    LOST = Failure(
        "lost", "the object is not in the hand any more", advice="grasp nearer to the centre of mass, or harder"
    )
    SLIPPED = Failure(
        "slipped", "the object hangs in the jaws by another place than it was taken", advice="grasp it elsewhere"
    )

    grip_m = In(float, "aperture when the jaws had closed, m")
    before_N = In(float, "weight when it was lifted, N", key="weight")

    def run(self) -> SkillRun:
        """See the class."""
        arm, p = self.context.arm, self.params
        blocks = yield from arm.hold(p.look_s, tactile=True)
        weight = yield from weigh_N(arm)
        apart = float(np.median([b.gripper.aperture_m for b in blocks]))
        frames = [b.tactile for b in blocks if b.tactile is not None]
        touched = _touched(frames[-1]) if frames else None
        moved = apart - self.grip_m
        self.event(
            "hold", weight_N=weight, aperture_m=apart, moved_m=moved, gels_touched=-1 if touched is None else touched
        )
        heavy = weight >= p.weight_kept * self.before_N
        steady = abs(moved) <= p.slip_m
        against = [not heavy, not steady, touched == 0]
        if sum(against) >= 2:
            raise self.LOST(
                f"{weight:.2f} N of {self.before_N:.2f} N hang in the hand, the jaws moved by {moved * 1e3:.1f} mm, "
                f"{'unknown' if touched is None else touched} of 2 gels are touched",
                weight_N=weight,
                moved_m=moved,
                gels_touched=-1 if touched is None else touched,
            )
        if not steady:
            raise self.SLIPPED(
                f"the jaws moved by {moved * 1e3:.1f} mm while it was lifted ({p.slip_m * 1e3:g} mm are allowed)",
                moved_m=moved,
                slip_limit_m=p.slip_m,
            )


def _touched(frame: TactileFrame) -> int:
    """Return how many of the two gels are touched."""
    return sum(patch_statistics(d).valid for d in (frame.left_m, frame.right_m))
