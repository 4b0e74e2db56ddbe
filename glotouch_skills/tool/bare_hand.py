"""Make the closed hand the tool: its section is the outline of the fingers."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import finger_outline_half_m, yaw_near_home
from glotouch_bt.robot import Pose
from glotouch_bt.skill import MOTION_REFUSED, Failure, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.hand import REQUEST_FAILED, WRIST_STATES, set_payload_and_tare
from glotouch_skills.common.probe import corner_place, corners

TRAVEL_M_S = 0.1
"""Speed on the way to the corner."""


class BareHandParams(SkillParams):
    """Parameters of `bare_hand`."""

    aperture_m: float = param("Opening of the jaws while touching", unit="m", default=0.0, ge=0.0, le=0.085)
    yaw_deg: float = param("Direction of the fingers' width in B", unit="deg", default=0.0, ge=-180.0, le=180.0)
    corner_gap_m: float = param(
        "Distance of the hand from both walls of the corner near the holder, over which it can be lowered",
        unit="m", default=0.026, ge=0.02, le=0.05,
    )  # fmt: skip


class BareHand(Skill):
    """Close the empty jaws, move over a free corner, turn to the yaw kept while touching, and tare.

    SUCCESS: `tool` is the hand, whose section is the outline of its fingers.
    """

    Params = BareHandParams
    params: BareHandParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers"}), "wrist": WRIST_STATES}
    POSTCONDITIONS: ClassVar = {"hand": "fingers", "wrist": "tared"}
    USES: ClassVar = frozenset({"arm"})

    PROBE_HELD = Failure("probe_held", "the probe is in the jaws", advice="return it first with tool_return")
    FAILURES: ClassVar = (REQUEST_FAILED, MOTION_REFUSED.with_meaning("the hand cannot be turned there"))

    tool = Out(HeldTool, "the fingers as a tool")

    def run(self) -> SkillRun:
        """See the class."""
        arm = self.context.arm
        if arm.scene.holding_tool:
            raise self.PROBE_HELD("the probe is in the jaws")
        state = yield from arm.jaws(self.params.aperture_m)
        here = arm.pose_B_P
        yaw = yaw_near_home(arm, np.deg2rad(self.params.yaw_deg))
        container = self.context.world.container.pose_B_K
        world = self.context.world
        over = container.apply(np.array([*corner_place(world, corners(world)[0], self.params.corner_gap_m), 0.0]))
        yield from arm.line(Pose.pointing_down((*over[:2], here.position_m[2]), yaw), TRAVEL_M_S)
        yield from set_payload_and_tare(self.context)
        self.tool = HeldTool.fingers(arm.description.gripper, state.aperture_m, yaw)
        half = finger_outline_half_m(arm.description.gripper, state.aperture_m)
        self.event("tool", held=True, section_half_m=half)
