"""Check that the probe is held as it was, by aperture and weight and, where they disagree, by touching the floor."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.hand import GRAVITY_M_S2, rise_clear, weigh
from glotouch_skills.common.probe import FEEL_FLOOR_FAILURES, HELD_TOLERANCE_M, feel_floor


class ToolCheckParams(SkillParams):
    """Parameters of `tool_check`."""

    light: float = param("Largest share of its weight that may be missing", default=0.5, gt=0.0, lt=1.0)
    askew: float = param(
        "Sine of a tilt, from its moment, from which the floor is touched", default=0.25, gt=0.0, lt=1.0
    )
    slip_m: float = param("Largest change of the floor's height", unit="m", default=0.002, gt=0.0, le=0.005)
    touch: bool = param("Touch the floor even if jaws and weight agree", default=False)
    speed_m_s: float = param("Speed with the probe in the hand", unit="m/s", default=0.25, gt=0.0, le=0.25)
    corner_gap_m: float = param(
        "Distance of the ball's centre from each wall of that corner", unit="m", default=0.018, ge=0.008, le=0.05
    )


class ToolCheck(Skill):
    """Rise to free air and compare aperture and weight with those of the held probe.

    If both agree, the probe is held; if both disagree, it is lost. If one disagrees (a drifted tare looks like a
    weight, and a frozen jaw report hides a loss), touch the floor in a free corner: without a probe nothing is touched
    there. A probe that turned in the jaws weighs the same, but gives a moment. So does a drifted torque: the floor
    decides: a turned probe's ball meets it too high. The way down is slow then.

    No check is needed after the probe was released on purpose (`tool_return`, `stow`).

    SUCCESS: the probe is held as it was taken.
    """

    Params = ToolCheckParams
    params: ToolCheckParams

    # After success the probe is in the hand, whatever happened before.
    PRECONDITIONS: ClassVar = {
        "hand": frozenset({"probe", "empty", "untared"}),
        "wrist": frozenset({"tared", "stale"}),  # where the weight disagrees with the jaws, the floor decides
    }
    POSTCONDITIONS: ClassVar = {"hand": "probe"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})

    TOOL_LOST = Failure(
        "tool_lost",
        "the probe is not in the hand",
        advice="the probe lies in or beside the container; put it into its holder by hand",
    )
    TOOL_SLIPPED = Failure(
        "tool_slipped",
        "the probe is held, but its ball is not where it was: it hangs askew, or the floor was felt too high "
        "or too low",
        advice="return the probe to its holder and pick it up again",
    )
    FAILURES: ClassVar = (
        *FEEL_FLOOR_FAILURES,
        MOTION_REFUSED.with_meaning("the hand cannot rise, or the corner cannot be reached"),
    )

    taken = In(HeldTool, "the probe as it was taken", key="tool")
    tool = Out(HeldTool, "the probe with its present aperture")
    tool_lost = Out(bool, "the probe is not in the hand", always=True)

    def run(self) -> SkillRun:
        """See the class."""
        self.tool_lost = False
        arm, tool, p = self.context.arm, self.taken, self.params
        if not arm.scene.holding_tool:
            self.tool_lost = True
            raise self.TOOL_LOST("the probe is not in the hand any more")
        yield from rise_clear(arm)
        felt = yield from weigh(arm)  # the tare was taken with the probe in the hand
        missing_N = -felt.weight_N
        weight_N = self.context.world.probe.mass_kg * GRAVITY_M_S2
        apart = arm.aperture_m
        light = not missing_N < p.light * weight_N
        other = not abs(apart - tool.aperture_m) <= HELD_TOLERANCE_M
        level_Nm = weight_N * self.context.world.probe.com_below_grasp_m  # its weight's moment if it were held level
        askew = not light and not felt.moment_Nm <= p.askew * level_Nm
        floor_m: float | None = tool.floor_z_K_m
        if light and other:
            floor_m = None
        elif light or other or askew or p.touch:
            floor_m = yield from feel_floor(self.context, tool, p.corner_gap_m, p.speed_m_s, askew)
        self.event("tool_check", missing_N=missing_N, aperture_m=apart, floor_z_K_m=floor_m)
        if floor_m is None:
            self.tool_lost = True
            why = "" if light and other else ", and nothing was met where the floor is"
            arm.scene.hold_tool(False)
            arm.felt.forget()
            raise self.TOOL_LOST(
                f"the probe is not in the hand: {missing_N:.2f} N of its {weight_N:.2f} N are missing, the jaws are "
                f"{apart * 1e3:.1f} mm apart and were {tool.aperture_m * 1e3:.1f} with it" + why,
                missing_N=missing_N,
                aperture_m=apart,
                taken_m=tool.aperture_m,
            )
        off = floor_m - tool.floor_z_K_m
        if not np.abs(off) <= p.slip_m:
            raise self.TOOL_SLIPPED(
                f"the floor was felt {off * 1e3:.1f} mm from where it was: the probe slipped"
                + (" and hangs askew" if askew else "")
                + " in the jaws",
                off_m=float(off),
                moment_Nm=felt.moment_Nm,
                level_Nm=level_Nm,
            )
        self.tool = replace(tool, aperture_m=apart)
