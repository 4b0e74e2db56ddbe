"""Put the object in the hand back where it was taken."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import hand_pose_B
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Pose
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, In, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import (
    MIN_GRIP_M,
    MIN_GRIP_N,
    RELEASE_HEIGHT_M,
    keeping_clear_of,
    let_jaws_rest,
    lower,
    neighbours,
    release,
    rise_clear,
)
from glotouch_skills.common.planning import GraspPlan

OPENED_M = 0.02
"""The jaws are opened at least this much wider than the object. Source: ours."""
ALIKE_M = 0.004
"""Maximum change of the aperture of jaws that still hold the object as it was taken. Source: as `slip_m` of `lift`."""


class PutBackParams(SkillParams):
    """Parameters of `put_back`."""

    speed_m_s: float = param("Speed high above the objects", unit="m/s", default=0.10, gt=0.0, le=0.25)
    approach_speed_m_s: float = param("Speed of the descent to just above its place", unit="m/s", default=0.02, gt=0.0,
                                      le=0.10)  # fmt: skip
    lower_speed_m_s: float = param("Speed of setting down", unit="m/s", default=0.008, gt=0.0, le=0.04)
    drop_m: float = param("Largest height above its place at which it may be released", unit="m", default=0.015, ge=0.0,
                          le=0.05)  # fmt: skip
    min_aperture_m: float = param("Minimum aperture of jaws that hold something", unit="m", default=MIN_GRIP_M, ge=0.0)


class PutBack(Skill):
    """Rise, lower the object to where it was taken, open gently, rise again. Jaws that hold nothing only open.

    The object is released just above where it was taken, or where it touches something on the way down.

    SUCCESS: the jaws are open and high.
    """

    Params = PutBackParams
    params: PutBackParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object", "empty"})}
    POSTCONDITIONS: ClassVar = {"hand": "empty"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})

    IN_THE_WAY = Failure(
        "in_the_way",
        "the object met something high above its place; it is still held, and high",
        advice="another object stands there now; set the object down by hand",
    )
    FAILURES: ClassVar = (
        MOTION_REFUSED.with_meaning("the place cannot be reached, with the object still held, or the jaws were caught"),
    )

    made = In(GraspPlan, "how it was taken", required=False)
    known = In(tuple, "all candidates, to keep clear of", key="candidates", element=Candidate, required=False)

    def run(self) -> SkillRun:
        """See the class."""
        arm, p, made = self.context.arm, self.params, self.made
        yield from rise_clear(arm, p.speed_m_s)
        yield from let_jaws_rest(arm)
        apart = arm.aperture_m
        stroke_m = arm.description.gripper.stroke_m
        opening = min(max(apart, 0.0) + OPENED_M, stroke_m)
        if made is None or not self._holds(made):
            yield from arm.jaws(opening)
            return
        opening = min(max(made.opening_m, opening), stroke_m)
        container = self.context.world.container
        place = hand_pose_B(arm, container, made.position_K_m + np.array([0.0, 0.0, RELEASE_HEIGHT_M]), made.yaw_rad)
        high = float(arm.pose_B_P.position_m[2])
        over = Pose(np.array([*place.position_m[:2], high]), place.quat)
        others = neighbours(self.known or (), made.candidate)
        with keeping_clear_of(arm, others):
            if np.linalg.norm(over.position_m - arm.pose_B_P.position_m) > 1e-3:
                yield from arm.line(over, p.speed_m_s, what="put back")
            reached, above = yield from lower(self.context, place, p.approach_speed_m_s, p.lower_speed_m_s)
        if not reached and above > p.drop_m:
            yield from rise_clear(arm, p.speed_m_s)
            raise self.IN_THE_WAY(
                f"it met something {above * 1e3:.0f} mm above its place and is still held", above_m=above
            )
        yield from release(arm, opening)
        yield from rise_clear(arm, p.speed_m_s)
        self.event("put_back", candidate=made.candidate, above_m=above)

    def _holds(self, made: GraspPlan) -> bool:
        """Return True if the jaws may hold what the grasp took: they press, or are as far apart as on the object.

        They are opened up here only if force and aperture both show that they hold nothing.
        """
        jaws = self.context.observation.gripper
        taken_m = made.aperture_m if made.closed_m is None else made.closed_m
        alike = abs(jaws.aperture_m - taken_m) <= ALIKE_M
        return jaws.aperture_m >= self.params.min_aperture_m and (alike or jaws.force_N >= MIN_GRIP_N)
