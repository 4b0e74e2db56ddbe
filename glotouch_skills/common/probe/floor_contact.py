"""Touch the container's floor with the held probe, in a corner."""

from __future__ import annotations

import numpy as np

from glotouch_bt.motion import FREE_M_S, Motion
from glotouch_bt.perception.touch import GuardParams
from glotouch_bt.skill import Context
from glotouch_bt.skill.probing import HeldTool, Prober
from glotouch_skills.common.hand import may_touch
from glotouch_skills.common.probe.free_corner import corner_of, corner_place

FLOOR_SEARCH_M = 0.005
"""Search for the floor down to this far below its nominal height."""
RIM_M = 0.015
"""The descent is guarded from this height above the container's rim to this depth below it: the registration may be
wrong by more than the distance to the walls. Where something may stand, the whole descent is guarded: an object may be
higher than the box. Source: ours."""
GUARDED_FROM_M = 0.04
"""Height above the floor from which the descent is guarded: the probe may have sunk in the jaws by its handle."""
GUARDED_M_S = 0.02
"""Speed of the descent from there, and past the rim."""
SLOW_FROM_M = 0.02
"""Height above the floor from which the descent is slow."""
SLOW_M_S = 0.01
"""Speed of the descent from there."""
RETREAT_M = 0.01
"""Retreat from the floor by this distance."""
RETREAT_M_S = 0.05
"""Speed of the retreat."""

FEEL_FLOOR_FAILURES = Prober.FAILURES


def feel_floor(
    context: Context, tool: HeldTool, corner_gap_m: float, speed_m_s: float, slowly: bool = False
) -> Motion[float | None]:
    """Lower the ball in the tool's corner; return the height in K of what it met, or None without contact.

    What it met is the floor only if the height says so: something may stand in that corner, and a box that is not where
    it was registered is met at its rim.

    Args:
        context: The skill's.
        tool: The held probe; the floor is expected at the height it was touched at before.
        corner_gap_m: Distance of the ball's centre from each wall of that corner.
        speed_m_s: Speed on the way there.
        slowly: The ball may be centimetres from where it is believed, or something may stand in the corner.

    Raises:
        SkillFailed: `hard_contact`.
        MotionRefused: The corner cannot be reached.
    """
    world, arm = context.world, context.arm
    corner = corner_place(world, corner_of(world, tool), corner_gap_m)
    prober = Prober(context, tool, GuardParams())
    rim = world.container.interior_m[2]
    yield from prober.hop(np.array([*corner, 0.0]), max(rim + 0.06, float(prober.tip_K_m[2])), speed_m_s)
    high, floor = float(prober.tip_K_m[2]), tool.floor_z_K_m
    inside_m_s = GUARDED_M_S if slowly else min(speed_m_s, FREE_M_S)
    speed_steps = (
        (0.0 if slowly else high - rim - RIM_M, GUARDED_M_S),
        (high - rim + RIM_M, inside_m_s),
        (high - floor - GUARDED_FROM_M, GUARDED_M_S),
        (high - floor - SLOW_FROM_M, SLOW_M_S),
    )
    with may_touch(arm, "tool", "floor", "table"):  # the table is under the floor: nothing reaches it
        lowest = np.array([*corner, floor + tool.tip_radius_m - FLOOR_SEARCH_M])
        probed = yield from prober.move(lowest, speed_m_s, speed_steps=speed_steps)
        if probed.contact is None:
            return None
        yield from prober.retreat(np.array([0.0, 0.0, 1.0]), RETREAT_M, RETREAT_M_S)
    return float(probed.contact.tip_K_m[2]) - tool.tip_radius_m
