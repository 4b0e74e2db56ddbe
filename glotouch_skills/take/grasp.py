"""Grasp the chosen object."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion, hand_pose_B
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import MotionRefused, Pose
from glotouch_bt.skill import UNCHANGED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import (
    CLEARANCE_M,
    MIN_GRIP_M,
    NoSpace,
    close_compliantly,
    descend,
    keeping_clear_of,
    neighbours,
    require_clear,
)
from glotouch_skills.common.planning import GraspPlan


class GraspParams(SkillParams):
    """Parameters of `grasp`."""

    force_N: float = param("Jaw force", unit="N", default=20.0, gt=0.0, le=30.0)
    closing_speed_m_s: float = param("Closing speed", unit="m/s", default=0.03, gt=0.0, le=0.2)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.25, gt=0.0, le=0.25)
    descent_speed_m_s: float = param(
        "Speed of the descent beside the object", unit="m/s", default=0.010, gt=0.0, le=0.04
    )
    headroom_m: float = param(
        "Height of the fingertips above the floor on the way", unit="m", default=0.15, ge=0.05, le=0.25
    )
    side_gap_m: float = param("Least gap between open jaw and object", unit="m", default=0.005, ge=0.001, le=0.03)
    min_aperture_m: float = param("Minimum aperture of jaws that hold something", unit="m", default=MIN_GRIP_M, ge=0.0)


class Grasp(Skill):
    """Descend over the object with open jaws and close with limited force; try the plan's alternatives in turn.

    Grasps that were made before, and did not last, come last.

    SUCCESS: the jaws stopped on an object; `grip_m` is their aperture, `made` the grasp.
    """

    Params = GraspParams
    params: GraspParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers"}), "wrist": frozenset({"tared"})}
    POSTCONDITIONS: ClassVar = {"hand": "object"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "empty"})}
    USES: ClassVar = frozenset({"arm"})

    NO_GRASP = Failure(
        "no_grasp",
        "no grasp of the plan could be made: the hand would collide, the fingers touched something, or the jaws "
        "closed on nothing; the hand has risen, jaws open",
        advice="the object or a neighbour was moved; squeeze it again",
    )
    NO_SPACE = Failure(
        "no_space",
        "the open hand fits at no grasp of the plan beside the neighbours and the walls; nothing moved",
        advice="make space with `nudge`, or with `clear_plan`, `grasp`, `lift` and `set_down`",
    )

    plan = In(GraspPlan, "the planned grasps")
    known = In(tuple, "all candidates, to keep clear of", key="candidates", element=Candidate, required=False)
    before = In(tuple, "grasps made before", key="tried", required=False)
    doubtful_before = In(
        tuple, "indices of candidates on which closures met something", key="doubtful", element=int, required=False,
        expected=False,
    )  # fmt: skip
    grip_m = Out(float, "aperture of the closed jaws, m")
    made = Out(GraspPlan, "the grasp that was made")
    tried = Out(tuple, "grasps made so far", element=GraspPlan)
    graspable = Out(bool, "false: no grasp could be made though the hand fits; the object was moved", always=True)
    cramped = Out(tuple, "index of the candidate if the hand fits at no grasp of it", element=int, always=True)
    lacks_space = Out(bool, "the hand fits at no grasp of the plan", always=True)
    doubtful = Out(
        tuple, "the same, with a candidate of which no grasp could be made: it was moved", element=int, always=True
    )

    def run(self) -> SkillRun:
        """See the class."""
        plan = self.plan
        others = neighbours(self.known or (), plan.candidate)
        made: tuple[GraspPlan, ...] = self.before or ()
        self.graspable, self.doubtful = True, self.doubtful_before or ()
        self.cramped, self.lacks_space = (), False
        options = sorted((plan, *plan.alternatives), key=lambda option: any(_same(option, m) for m in made))
        tried: list[MotionRefused] = []
        with keeping_clear_of(self.context.arm, others):
            for option in options:
                try:
                    self.grip_m = yield from self._attempt(option)
                    self.made, self.tried = replace(option, closed_m=self.grip_m), (*made, option)
                    return
                except MotionRefused as refusal:
                    tried.append(refusal)
                    self.event("note", text=f"a grasp was given up: {refusal}")
        if all(isinstance(refusal, NoSpace) for refusal in tried):
            self.cramped, self.lacks_space = (plan.candidate,), True
            raise self.NO_SPACE(
                f"the hand fits at none of {len(tried)} grasps; the last: {tried[-1]}", grasps=len(tried)
            )
        self.graspable, self.doubtful = False, tuple(sorted({*self.doubtful, plan.candidate}))
        raise self.NO_GRASP(f"none of {len(tried)} grasps could be made; the last: {tried[-1]}", grasps=len(tried))

    def _attempt(self, plan: GraspPlan) -> Motion[float]:
        """Make one grasp and return the aperture of the closed jaws.

        Raises:
            MotionRefused: It could not be made; the hand is above the objects with open jaws.
        """
        arm, p = self.context.arm, self.params
        container = self.context.world.container
        goal = hand_pose_B(arm, container, plan.position_K_m, plan.yaw_rad)
        high = np.array([*plan.position_K_m[:2], p.headroom_m + arm.description.gripper.fingertip_below_P_m])
        above = Pose(container.pose_B_K.apply(high), goal.quat)
        opening = self._opening(goal, plan)
        yield from arm.jaws(opening, speed_m_s=0.2)
        travel_z = max(float(arm.pose_B_P.position_m[2]), float(above.position_m[2]))
        yield from arm.transit(above, height_B_m=travel_z, speed_m_s=p.travel_speed_m_s)
        top_m = max((c.height_m for c in self.known or () if c.index == plan.candidate), default=np.inf)
        if not (yield from descend(self.context, goal, opening, top_m, p.descent_speed_m_s)):
            yield from arm.line(above, p.travel_speed_m_s, check=False)
            raise MotionRefused("grasp", "the fingers stood on something on the way down")
        try:
            state = yield from close_compliantly(arm, p.closing_speed_m_s, p.force_N)
        except MotionRefused:
            yield from arm.line(above, p.travel_speed_m_s, check=False)
            raise
        yield from arm.hold(0.1)
        self.event("grasp", aperture_m=state.aperture_m, expected_m=plan.aperture_m, force_N=state.force_N)
        if state.aperture_m < p.min_aperture_m:
            yield from arm.jaws(opening, speed_m_s=0.2)
            yield from arm.line(above, p.travel_speed_m_s, check=False)
            raise MotionRefused(
                "grasp",
                f"the jaws closed to {state.aperture_m * 1e3:.1f} mm, {plan.aperture_m * 1e3:.1f} mm were expected",
            )
        return state.aperture_m

    def _opening(self, goal: Pose, plan: GraspPlan) -> float:
        """Return the plan's opening, or a narrower one where the hand would collide with neighbours.

        Raises:
            MotionRefused: Even the narrowest collides.
        """
        widest = plan.opening_m
        narrowest = min(max(plan.aperture_m + 2 * self.params.side_gap_m, widest - 0.012), widest)
        for opening in (widest, 0.5 * (widest + narrowest)):
            try:
                require_clear(self.context.arm, goal, opening, CLEARANCE_M)
            except MotionRefused:
                continue
            return opening
        require_clear(self.context.arm, goal, narrowest)
        return narrowest


def _same(one: GraspPlan, other: GraspPlan) -> bool:
    """Return True if both take the same object at the same place."""
    alike = (one.candidate, one.yaw_rad) == (other.candidate, other.yaw_rad)
    return alike and bool((one.position_K_m == other.position_K_m).all())
