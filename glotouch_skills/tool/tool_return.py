"""Put the probe back into its holder."""

from __future__ import annotations

from typing import ClassVar

from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, In, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.hand import WRIST_STATES
from glotouch_skills.common.probe import RETURN_PROBE_FAILURES, return_probe


class ToolReturnParams(SkillParams):
    """Parameters of `tool_return`."""

    speed_m_s: float = param("Speed with the probe in the hand", unit="m/s", default=0.25, gt=0.0, le=0.25)
    insert_speed_m_s: float = param("Speed into the holder", unit="m/s", default=0.02, gt=0.0, le=0.1)


class ToolReturn(Skill):
    """Carry the probe over its holder, insert it, open the jaws, rise, and tare the empty hand.

    The probe is released only in the holder, also on preemption.

    SUCCESS: the jaws are empty and above the holder.
    """

    Params = ToolReturnParams
    params: ToolReturnParams

    # `untared`: the probe is released, but the wrist is not yet tared; only this skill or `tool_pickup` may follow.
    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "untared"}), "wrist": WRIST_STATES}
    POSTCONDITIONS: ClassVar = {"hand": "empty", "wrist": "tared"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "untared"}), "wrist": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})
    FAILURES: ClassVar = (
        *RETURN_PROBE_FAILURES,
        MOTION_REFUSED.with_meaning("the holder cannot be reached from here, or the probe does not go into it"),
    )

    tool = In(HeldTool, "the probe in the jaws")

    def run(self) -> SkillRun:
        """See the class."""
        tool, p = self.tool, self.params
        yield from return_probe(
            self.context, tool.yaw_B_rad, tool.aperture_m, speed_m_s=p.speed_m_s, insert_speed_m_s=p.insert_speed_m_s
        )
        self.event("tool", held=False)
