"""Put the object in the hand back where it was taken."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import JawRestDetector, hand_pose_B
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import Pose
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, In, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import glide, keeping_clear_of, release, rise_clear
from glotouch_skills.common.planning import GraspPlan

SLOW_FROM_M = 0.03
"""Height above its place from which the object is lowered slowly."""
JAW_REST_S = 1.5
"""Longest wait for jaws that lost their object to stop closing."""
RELEASE_HEIGHT_M = 0.0015
"""Release the object at this height above its place: a stiff arm would press it hard on the floor."""


class PutBackParams(SkillParams):
    """Parameters of `put_back`."""

    speed_m_s: float = param("Speed high above the objects", unit="m/s", default=0.10, gt=0.0, le=0.25)
    approach_speed_m_s: float = param("Speed of the descent to just above its place", unit="m/s", default=0.02, gt=0.0,
                                      le=0.10)  # fmt: skip
    lower_speed_m_s: float = param("Speed of setting down", unit="m/s", default=0.008, gt=0.0, le=0.04)
    drop_m: float = param("Largest height above its place at which it may be released", unit="m", default=0.015, ge=0.0,
                          le=0.05)  # fmt: skip
    min_aperture_m: float = param(
        "Minimum aperture of jaws that hold something", unit="m", default=0.003, ge=0.0, formerly="least_aperture_m"
    )


class PutBack(Skill):
    """Rise, lower the object to where it was taken, open gently, rise again. Empty jaws only open.

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
        yield from self._let_jaws_rest()
        apart = arm.aperture_m
        opening = min(max(apart, 0.0) + 0.02, arm.description.gripper.stroke_m)
        if apart < p.min_aperture_m or made is None:
            yield from arm.jaws(opening)
            return
        opening = min(max(made.opening_m, opening), arm.description.gripper.stroke_m)
        container = self.context.world.container
        place = hand_pose_B(arm, container, made.position_K_m + np.array([0.0, 0.0, RELEASE_HEIGHT_M]), made.yaw_rad)
        high = float(arm.pose_B_P.position_m[2])
        over = Pose(np.array([*place.position_m[:2], high]), place.quat)
        near = Pose(place.position_m + np.array([0.0, 0.0, SLOW_FROM_M]), place.quat)
        others = [c for c in self.known or () if c.index != made.candidate]
        with keeping_clear_of(arm, others):
            if np.linalg.norm(over.position_m - arm.pose_B_P.position_m) > 1e-3:
                yield from arm.line(over, p.speed_m_s, what="put back")
            reached = yield from glide(self.context, near, p.approach_speed_m_s)
            reached = reached and (yield from glide(self.context, place, p.lower_speed_m_s))
        above = float(arm.pose_B_P.position_m[2] - place.position_m[2])
        if not reached and above > p.drop_m:
            yield from rise_clear(arm, p.speed_m_s)
            raise self.IN_THE_WAY(
                f"it met something {above * 1e3:.0f} mm above its place and is still held", above_m=above
            )
        yield from release(arm, opening)
        yield from rise_clear(arm, p.speed_m_s)
        self.event("put_back", candidate=made.candidate, above_m=above)

    def _let_jaws_rest(self) -> SkillRun:
        """Wait until the jaws rest: jaws that are still closing would look like jaws that hold something."""
        arm = self.context.arm
        watch = JawRestDetector(arm.period_s)
        for _ in range(round(JAW_REST_S / arm.period_s)):
            (seen,) = yield from arm.hold(arm.period_s)
            if watch.still(seen.now_s, seen.gripper):
                return
