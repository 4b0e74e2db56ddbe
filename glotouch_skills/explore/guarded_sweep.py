"""Sweep the container with the probe until something is touched."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from glotouch_bt.perception.search import SearchMap, policy_names, search_policy, seek
from glotouch_bt.perception.touch import Contact
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.probe import Explorer, ExploringSpeeds

if TYPE_CHECKING:
    PolicyName = str
else:
    PolicyName = Literal[*policy_names()]


class GuardedSweepParams(SkillParams):
    """Parameters of `guarded_sweep`."""

    expected_objects: int = param("Number of objects in the container", default=5, ge=1, le=20)
    policy: PolicyName = param(
        "How to choose the next place: most expected finds for the distance, or one of the paper's two policies",
        default="expected_find",
    )
    height_m: float = param(
        "Height of the ball's centre above the floor while sweeping", unit="m", default=0.018, ge=0.009, le=0.06
    )
    speed_m_s: float = param("Sweeping speed", unit="m/s", default=0.04, gt=0.0, le=0.08)
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.25, gt=0.0, le=0.25)
    headroom_m: float = param(
        "Height of the ball above the floor when crossing objects", unit="m", default=0.13, ge=0.02, le=0.2
    )
    wall_gap_m: float = param(
        "Distance of the ball's centre from the walls", unit="m", default=0.012, ge=0.008, le=0.05
    )


class GuardedSweep(Skill):
    """Sweep by the policy until an object that is not yet traced is touched, and retreat from it.

    SUCCESS: something was touched; `contact` is the contact, and the probe has retreated.
    """

    PAUSE = "retreat"
    Params = GuardedSweepParams
    params: GuardedSweepParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "fingers"})}
    USES: ClassVar = frozenset({"arm"})

    SEARCH_EXHAUSTED = Failure(
        "search_exhausted",
        "nothing is left to explore, or to reach",
        advice="check expected_objects; a lower height_m meets flatter objects",
    )
    FAILURES: ClassVar = (*Explorer.FAILURES, MOTION_REFUSED)

    tool = In(HeldTool, "the held probe")
    previous = In(SearchMap, "what has been explored so far", key="map", required=False)
    map = Out(SearchMap, "what has been explored now")
    contact = Out(Contact, "the contact that ended the sweep")
    exhausted = Out(bool, "nothing is left to explore, or to reach", always=True, on_success=False)

    def run(self) -> SkillRun:
        """See the class."""
        self.exhausted = False
        p, tool = self.params, self.tool
        speeds = ExploringSpeeds(
            sweep_m_s=p.speed_m_s, travel_m_s=p.travel_speed_m_s, height_m=p.height_m, headroom_m=p.headroom_m
        )
        explorer = Explorer(self.context, tool, speeds, self.event)
        belief = self.previous or self._blank_map()
        plan = seek(belief, search_policy(p.policy), explorer.tip_K_m, lowered=explorer.lowered)
        sought = yield from explorer.run(plan)
        self.map = sought.belief
        if sought.contact is None:
            self.exhausted = True
            raise self.SEARCH_EXHAUSTED(
                f"nothing unexplored is left; {belief.found} of {p.expected_objects} objects were found",
                found=belief.found,
            )
        self.contact = sought.contact

    def _blank_map(self) -> SearchMap:
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - self.params.wall_gap_m
        return SearchMap.blank(half, expected=self.params.expected_objects)
