"""Take hold of the chosen object."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Pose
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.grasp_plan import GraspPlan
from skills.hand import glide, hand_pose_B


class GraspParams(SkillParams):
    """Parameters of `grasp`."""

    force_N: float = param("Jaw force", unit="N", default=30.0, gt=0.0, le=30.0)
    closing_speed_m_s: float = param("Closing speed", unit="m/s", default=0.03, gt=0.0, le=0.2)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.25, gt=0.0, le=0.25)
    descent_speed_m_s: float = param("Speed down beside the object", unit="m/s", default=0.015, gt=0.0, le=0.04)
    headroom_m: float = param("Fingertips above the floor on the way", unit="m", default=0.14, ge=0.05, le=0.25)
    least_aperture_m: float = param("Closed farther than this: nothing held", unit="m", default=0.003, ge=0.0)


class Grasp(Skill):
    """Go down over the object with open jaws and close on it with limited force.

    SUCCESS: the jaws stopped on something; `grip_m` is their aperture.
    FAILURE `nothing_held`: they closed on nothing.
    FAILURE `way_down_blocked`: the fingers stand on something; the hand has risen again.
    FAILURE `motion_refused`: the pose cannot be reached without hitting the container.
    """

    Params = GraspParams
    params: GraspParams
    plan = In(GraspPlan, "where and how wide")
    grip_m = Out(float, "aperture of the closed jaws, m")

    def run(self) -> SkillRun:
        """See the class."""
        arm, p, plan = self.context.arm, self.params, self.plan
        pose_B_K = self.context.world.container.pose_B_K
        gripper = arm.description.gripper
        goal = hand_pose_B(arm, self.context.world.container, plan.position_K_m, plan.yaw_rad)
        high = np.array([*plan.position_K_m[:2], p.headroom_m + gripper.fingertip_below_P_m])
        above = Pose(pose_B_K.apply(high), goal.quat)
        yield from arm.jaws(min(plan.opening_m, gripper.stroke_m), speed_m_s=0.2)
        travel_z = max(float(arm.pose_B_P.position_m[2]), float(above.position_m[2]))
        yield from arm.transit(above, height_B_m=travel_z, speed_m_s=p.travel_speed_m_s)
        if not (yield from glide(self.context, goal, p.descent_speed_m_s)):
            yield from arm.line(above, p.travel_speed_m_s, check=False)
            raise SkillFailed(
                "way_down_blocked",
                "the fingers met something on the way down to the grasp",
                advice="the object or a neighbour was moved; squeeze it again",
            )
        state = yield from arm.jaws(0.0, speed_m_s=p.closing_speed_m_s, force_N=p.force_N)
        yield from arm.hold(0.1)
        self.event("grasp", aperture_m=state.aperture_m, expected_m=plan.aperture_m, force_N=state.force_N)
        if state.aperture_m < p.least_aperture_m:
            raise SkillFailed(
                "nothing_held",
                f"the jaws closed to {state.aperture_m * 1e3:.1f} mm; {plan.aperture_m * 1e3:.1f} mm were expected",
                advice="the object was moved; squeeze it again",
                aperture_m=state.aperture_m,
            )
        self.grip_m = state.aperture_m
