"""Put the probe back into its holder."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np

from glotouch_bt.robot import Pose, SetPayload, Tare
from skills.base import UNCHANGED, In, Skill, SkillParams, SkillRun, param
from skills.held_tool import HeldTool
from skills.requests import finish

OVER_HOLDER_M = 0.002
"""This near to the holder's axis the probe is in it, or on its way in (the skill was broken off there)."""


class ToolReturnParams(SkillParams):
    """Parameters of `tool_return`."""

    speed_m_s: float = param("Speed with the probe in the hand", unit="m/s", default=0.10, gt=0.0, le=0.15)
    insert_speed_m_s: float = param("Speed into the holder", unit="m/s", default=0.03, gt=0.0, le=0.1)


class ToolReturn(Skill):
    """Carry the probe over its holder, lower it in, open the jaws, rise, and tare the empty hand.

    The probe is let go of nowhere but in the holder, also when the skill is broken off.

    SUCCESS: the jaws are empty and above the holder.
    FAILURE `request_failed`: the sensor could not be zeroed, or the payload not be set.
    FAILURE `motion_refused`: the holder cannot be reached from here.
    """

    Params = ToolReturnParams
    params: ToolReturnParams

    # `untared`: let go of, but not yet zeroed without it; nothing but this skill or `tool_pickup` may follow.
    NEEDS: ClassVar = {"hand": frozenset({"probe", "untared"})}
    LEAVES: ClassVar = {"hand": "empty"}
    AFTER_FAILURE: ClassVar = {"hand": frozenset({UNCHANGED, "untared"})}
    USES: ClassVar = frozenset({"arm"})
    FAILURES: ClassVar = {
        "request_failed": "the sensor could not be zeroed, or the payload not be set",
        "motion_refused": "the holder cannot be reached from here",
    }

    tool = In(HeldTool, "the probe in the jaws")

    def run(self) -> SkillRun:
        """See the class."""
        arm, world, p = self.context.arm, self.context.world, self.params
        grasp = Pose.pointing_down(world.holder.pose_B_grasp.position_m, self.tool.yaw_B_rad)
        above = dataclasses.replace(
            grasp, position_m=grasp.position_m + np.array([0.0, 0.0, world.probe.length_m + 0.06])
        )
        here = arm.pose_B_P.position_m
        if here[2] > above.position_m[2] or np.linalg.norm(here[:2] - above.position_m[:2]) > OVER_HOLDER_M:
            height = max(float(here[2]), float(above.position_m[2]))
            yield from arm.transit(above, height_B_m=height, speed_m_s=p.speed_m_s)
        yield from arm.line(grasp, p.insert_speed_m_s, check=False)
        opening = min(self.tool.aperture_m + 0.03, arm.description.gripper.stroke_m)
        yield from arm.jaws(opening, speed_m_s=0.08)
        arm.scene.hold_tool(False)
        yield from arm.shift(np.array([0.0, 0.0, 0.08]), 0.08, check=False)
        yield from finish(self.context.requests.start(SetPayload(0.0, np.zeros(3))), "payload")
        yield from arm.hold(0.2)
        yield from finish(self.context.requests.start(Tare()), "tare")
        self.event("tool", held=False)
