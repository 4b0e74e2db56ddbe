"""Check that the lifted object is held as it was taken, by two of weight, jaws and gels."""

from __future__ import annotations

from typing import ClassVar

from glotouch_bt.skill import UNCHANGED, Failure, In, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import feel_hold


class HoldCheckParams(SkillParams):
    """Parameters of `hold_check`."""

    measure_s: float = param("Time for which gels and jaws are measured", unit="s", default=0.2, ge=0.05, le=2.0)
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

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"}), "wrist": frozenset({"tared"})}
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
        p = self.params
        hold = yield from feel_hold(self.context.arm, self.grip_m, p.measure_s)
        self.event("hold", **hold.as_dict())
        failed = hold.failed_checks(p.weight_kept * self.before_N, p.slip_m)
        if len(failed) >= 2:
            raise self.LOST("; ".join(failed), **hold.as_dict())
        if not abs(hold.moved_m) <= p.slip_m:
            raise self.SLIPPED(
                f"the jaws moved by {hold.moved_m * 1e3:.1f} mm since they closed; {p.slip_m * 1e3:g} mm are allowed",
                moved_m=hold.moved_m,
                slip_limit_m=p.slip_m,
            )
