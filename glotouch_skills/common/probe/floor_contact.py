"""Touching the container's floor with the held probe, in the corner that no object reaches."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.touch import GuardParams
from glotouch_bt.skill import Context
from glotouch_bt.skill.probing import HeldTool, Prober
from glotouch_skills.common.hand import may_touch
from glotouch_skills.common.probe.free_corner import corner_place

FLOOR_SEARCH_M = 0.005
"""The floor is looked for this far below where it should be."""
DOWN_M_S, LISTENING_M_S, OFF_M_S = 0.01, 0.02, 0.05
NEAR_M, SUNK_M, OFF_M = 0.02, 0.04, 0.01
"""The ball goes down slowly from so far above the floor, listening from so far above it (a probe may have sunk in the
jaws by the length of its handle), and is raised so far off it again."""

FEEL_FLOOR_FAILURES = Prober.FAILURES


def feel_floor(context: Context, tool: HeldTool, corner_gap_m: float, speed_m_s: float) -> Motion[float | None]:
    """Lower the ball in the corner nearest to the holder; the floor's height in K, or None if nothing was met.

    Args:
        context: The skill's.
        tool: The held probe; the floor is expected where it was felt with it before.
        corner_gap_m: Ball centre to each wall at that corner.
        speed_m_s: On the way there.

    Raises:
        SkillFailed: `hard_contact`.
        MotionRefused: The corner cannot be reached.
    """
    world, arm = context.world, context.arm
    corner = corner_place(world, corner_gap_m)
    prober = Prober(context, tool, GuardParams())
    high = world.container.interior_m[2] + 0.06
    yield from prober.hop(np.array([*corner, 0.0]), max(high, float(prober.tip_K_m[2])), speed_m_s)
    yield from arm.line(tool.pose_B_P(world, np.array([*corner, tool.floor_z_K_m + SUNK_M])), speed_m_s)
    probed = yield from prober.move(np.array([*corner, tool.floor_z_K_m + NEAR_M]), LISTENING_M_S)
    with may_touch(arm, "tool", "floor"):
        lowest = tool.floor_z_K_m + tool.tip_radius_m - FLOOR_SEARCH_M
        if probed.contact is None:
            probed = yield from prober.move(np.array([*corner, lowest]), DOWN_M_S)
        if probed.contact is None:
            return None
        yield from prober.retreat(np.array([0.0, 0.0, 1.0]), OFF_M, OFF_M_S)
    return float(probed.contact.tip_K_m[2]) - tool.tip_radius_m
