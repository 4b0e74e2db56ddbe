"""Lift the grasped object and check that it came along."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.robot import Observation
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import MIN_GRIP_M, UP_B, feel_hold, release, rise_clear
from glotouch_skills.common.planning import GraspPlan

OPEN_BY_M = 0.02
"""Opening of the jaws that let go, beyond the held width: 10 mm on each side, as at a closure."""
START_M, START_M_S = 0.002, 0.004
"""Way and speed of the start. What holds the hand back does so at once: a train jammed at a wall pressed with 70 N for
each millimetre (simulated), and an arm that begins at full speed has risen half of one before a guard can stop it."""
LOWER_M_S = 0.02
"""Speed back down with an object that was held back."""


class LiftParams(SkillParams):
    """Parameters of `lift`."""

    height_m: float = param("Height of the lift", unit="m", default=0.15, gt=0.0, le=0.3)
    speed_m_s: float = param("Lifting speed", unit="m/s", default=0.06, gt=0.0, le=0.2)
    max_N: float = param(
        "Largest force on the hand as it rises, the object's weight included", unit="N", default=12.0, gt=0.0, le=25.0
    )
    min_weight_N: float = param("Least weight of a lifted object", unit="N", default=0.3, ge=0.0)
    min_aperture_m: float = param("Minimum aperture of jaws that hold something", unit="m", default=MIN_GRIP_M, ge=0.0)
    slip_m: float = param(
        "Largest change of the aperture since the jaws closed", unit="m", default=0.004, gt=0.0, le=0.02
    )
    measure_s: float = param("Time for which gels and jaws are measured", unit="s", default=0.2, ge=0.05, le=2.0)


class Lift(Skill):
    """Raise the hand under a force limit and check the hold at the top: by weight, jaws (aperture and force), and gels.

    All three measurements must agree: a wrist may be off zero, and jaws may report their target.
    Jaws that closed farther, with the object on both gels, hold one that turned between them: `grip_m` is written anew.
    An object that holds the hand back is lowered again and let go.

    SUCCESS: an object with weight hangs in the jaws, and the arm holds it up.
    """

    Params = LiftParams
    params: LiftParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"}), "wrist": frozenset({"tared"})}
    # `lost` if any check fails: the object may still be between the pads.
    FAILURE_STATES: ClassVar = {"hand": frozenset({"object", "empty"})}
    USES: ClassVar = frozenset({"arm"})

    LOST = Failure(
        "lost",
        "not all of weight, jaws and gels show the object at the top",
        advice="grasp nearer to the centre of mass, or harder",
    )
    STUCK = Failure(
        "stuck",
        "something holds the hand back as it rises; the jaws have let go, and the hand is above the objects",
        advice="the object is jammed between others or under one, or the jaws hold more than it; for a heavy one, "
        "raise max_N",
    )
    FAILURES: ClassVar = (MOTION_REFUSED.with_meaning("the arm cannot be raised so far"),)

    grip_m = In(float, "aperture of the closed jaws")
    made = In(GraspPlan, "how it was taken", required=False, expected=False)
    doubtful_before = In(
        tuple, "indices of candidates on which closures met something", key="doubtful", element=int, required=False,
        expected=False,
    )  # fmt: skip
    graspable = Out(bool, "false: something holds the hand back; more may be in the jaws than was traced", always=True)
    doubtful = Out(tuple, "the same, with the object that holds the hand back", element=int, always=True)
    held_m = Out(float, "aperture at the top", key="grip_m")
    weight_N = Out(float, "weight in the hand, N", key="weight", result=lambda w: f"weight in the hand {w:.2f} N")

    def run(self) -> SkillRun:
        """See the class."""
        arm, p = self.context.arm, self.params
        self.graspable, self.doubtful = True, self.doubtful_before or ()
        low_m, start_m = float(arm.pose_B_P.position_m[2]), min(START_M, p.height_m)
        for way_m, speed_m_s in ((start_m, START_M_S), (p.height_m - start_m, p.speed_m_s)):
            yield from self._rise(way_m, speed_m_s, low_m)
        hold = yield from feel_hold(arm, self.grip_m, p.measure_s)
        self.event("lift", **hold.as_dict())
        failed = hold.failed_checks(p.min_weight_N, p.slip_m, p.min_aperture_m, may_turn=True)
        if failed:
            raise self.LOST("; ".join(failed), **hold.as_dict())
        self.held_m, self.weight_N = hold.aperture_m, hold.weight_N

    def _rise(self, way_m: float, speed_m_s: float, low_m: float) -> Motion[None]:
        """Rise with the object, which was taken where P was at a height of `low_m` in B.

        Raises:
            SkillFailed: `stuck`; the jaws have let go, and the hand is above the objects.
        """
        arm, p = self.context.arm, self.params
        risen = yield from arm.shift(way_m * UP_B, speed_m_s, check=False, guard=self._held_back, what="lift")
        if not isinstance(risen.stop, float):
            return
        yield from self._let_go(float(arm.pose_B_P.position_m[2]) - low_m)
        self.graspable = False
        if self.made is not None:
            self.doubtful = tuple(sorted({*self.doubtful, self.made.candidate}))
        raise self.STUCK(
            f"{risen.stop:.1f} N on the hand after {risen.travelled_m * 1e3:.1f} mm, {p.max_N:.1f} N are allowed",
            force_N=risen.stop,
            limit_N=p.max_N,
        )

    def _held_back(self, seen: Observation) -> float | None:
        """Return the period's mean force, N, if it passes the limit (a `motion.Guard`)."""
        force_N = float(np.linalg.norm(seen.wrench_S[:, :3].mean(axis=0)))
        return None if force_N <= self.params.max_N else force_N

    def _let_go(self, risen_m: float) -> Motion[None]:
        """Lower the object to where it was taken, open the jaws, and rise without it."""
        arm = self.context.arm
        yield from arm.shift(-max(risen_m, 0.0) * UP_B, LOWER_M_S, check=False, what="lower again")
        yield from release(arm, min(max(arm.aperture_m, 0.0) + OPEN_BY_M, arm.description.gripper.stroke_m))
        yield from rise_clear(arm)
