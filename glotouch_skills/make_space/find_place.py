"""Find free places for the object in the hand."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import UNCHANGED, Failure, In, Out, Skill, SkillParams, SkillRun
from glotouch_skills.common.planning import ClearPlanner, FreePlace, GraspPlan
from glotouch_skills.make_space.clear_plan import obstacles


class FindPlaceParams(SkillParams):
    """No parameters."""


class FindPlace(Skill):
    """Find where the held object can be set down, for an object that cannot be put back where it was taken.

    A place is free if the object keeps its distance from all others and from the walls, and the opening fingers do,
    too. The place where it was taken is not free: something may stand there now.

    SUCCESS: `places` has the free places, nearest first; nothing was moved.
    """

    Params = FindPlaceParams
    params: FindPlaceParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"})}
    POSTCONDITIONS: ClassVar = {"hand": "object"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED})}
    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it computes

    NO_PLACE = Failure(
        "no_place",
        "there is no free place for the object, or it is not known which one is held; it is still held",
        advice="take it out of the hand",
    )

    made = In(GraspPlan, "how it was taken")
    known = In(tuple, "all candidates, the held one where it was taken", key="candidates", element=Candidate)
    map = In(SearchMap, "what has been explored", required=False, expected=False)
    places = Out(tuple, "where to set it down, nearest first", element=FreePlace)

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        held = next((c for c in self.known if c.index == self.made.candidate), None)
        if held is None:
            raise self.NO_PLACE(f"candidate {self.made.candidate} is held, and no longer among the candidates")
        half_extent = 0.5 * np.array(self.context.world.container.interior_m[:2])
        gripper = self.context.arm.description.gripper
        planner = ClearPlanner(self.known, half_extent, gripper, obstacles(self.map))
        places: tuple[FreePlace, ...] = ()
        for found in planner.free_places(held, self.made):
            places = found
            yield HOLD
        if not places:
            raise self.NO_PLACE(f"no place is free for candidate {held.index}, which is still held")
        self.places = places
