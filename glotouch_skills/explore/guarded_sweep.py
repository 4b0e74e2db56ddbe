"""Sweep the container with the probe until something is touched."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from glotouch_bt.perception.search import LEFT_BELOW, SearchMap, left_in_words, policy_names, search_policy, seek_next
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.probe import Explorer, ExploringSpeeds

if TYPE_CHECKING:
    PolicyName = str
else:
    PolicyName = Literal[*policy_names()]


class GuardedSweepParams(SkillParams):
    """Parameters of `guarded_sweep`."""

    expected_objects: Annotated[int, Field(ge=1, le=20)] | Literal["unknown"] = param(
        "Number of objects in the container; unknown: search until hardly anything of 15 mm or more can be left",
        default=5,
    )
    left_below: float = param(
        "With an unknown number: the search ends when the chance that something is left is below this",
        default=LEFT_BELOW, gt=0.0, lt=1.0,
    )  # fmt: skip
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
        "Height of the ball above the floor when crossing objects", unit="m", default=0.15, ge=0.02, le=0.2
    )
    wall_gap_m: float = param(
        "Distance of the ball's centre from the walls", unit="m", default=0.012, ge=0.008, le=0.05
    )


class GuardedSweep(Skill):
    """Sweep by the policy until an object that is not yet traced is touched, and retreat from it.

    If objects of a known number are missing and hardly a place is left, a candidate that is probably two bodies is
    divided.

    SUCCESS: something was touched; `contact` is the contact, and the probe has retreated.
    """

    PAUSE = "retreat"
    Params = GuardedSweepParams
    params: GuardedSweepParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "fingers"})}
    USES: ClassVar = frozenset({"arm"})

    SEARCH_EXHAUSTED = Failure(
        "search_exhausted",
        "nothing is left to explore or to reach, or hardly anything can be left",
        advice="check expected_objects; a lower height_m meets flatter objects",
    )
    FAILURES: ClassVar = (*Explorer.FAILURES, MOTION_REFUSED)

    tool = In(HeldTool, "the held probe")
    previous = In(SearchMap, "what has been explored so far", key="map", required=False)
    known = In(tuple, "candidates so far", key="candidates", element=Candidate, required=False)
    map = Out(SearchMap, "what has been explored now")
    candidates = Out(tuple, "candidates now", element=Candidate)
    contact = Out(Contact, "the contact that ended the sweep")
    exhausted = Out(bool, "nothing is left to explore, or to reach", always=True, on_success=False)
    chance_left = Out(
        float,
        "chance that an object of at least 15 mm is left; nan with a known number",
        always=True,
        result=left_in_words,
    )

    def run(self) -> SkillRun:
        """See the class."""
        known: tuple[Candidate, ...] = self.known or ()
        self.exhausted, self.chance_left = False, float("nan")
        self.candidates = known
        p, tool = self.params, self.tool
        speeds = ExploringSpeeds(
            sweep_m_s=p.speed_m_s, travel_m_s=p.travel_speed_m_s, height_m=p.height_m, headroom_m=p.headroom_m
        )
        explorer = Explorer(self.context, tool, speeds, self.event)
        belief = self.previous or self._blank_map()
        self.chance_left = belief.chance_left
        plan = seek_next(
            belief,
            known,
            search_policy(p.policy),
            explorer.tip_K_m,
            tool.tip_radius_m,
            lowered=explorer.lowered,
            round_tip=tool.round,
        )
        sought, self.candidates = yield from explorer.run(plan)
        for candidate in self.candidates:
            if not any(candidate is k for k in known):
                self.event(
                    "candidate", candidate=candidate, displaced_m=0.0, ended="one contour of two bodies", moves=0
                )
        self.map, self.chance_left = sought.belief, sought.belief.chance_left
        if sought.contact is None:
            self.exhausted = True
            of = f" of {belief.expected}" if belief.expected is not None else ""
            end = "all expected objects are traced" if sought.belief.complete else "nothing unexplored is left"
            why = left_in_words(self.chance_left) or end
            found = sought.belief.found
            raise self.SEARCH_EXHAUSTED(f"{why}; {found}{of} objects were found", found=found)
        self.contact = sought.contact

    def _blank_map(self) -> SearchMap:
        p = self.params
        length, width = self.context.world.container.interior_m[:2]
        half = 0.5 * np.array([length, width]) - p.wall_gap_m
        expected = None if p.expected_objects == "unknown" else p.expected_objects
        return SearchMap.blank(half, expected, p.left_below, (length, width))
