"""Plan which neighbour of a cramped object to lift out, how to grasp it, and where to set it down."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.perception.touch.outline import convex_hull
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.planning import Clearing, ClearPlanner, FreePlace, GraspPlan, Neighbour


class ClearPlanParams(SkillParams):
    """Parameters of `clear_plan`."""

    candidate: int = param(
        "Index of the object to take out; -1: a neighbour of the first cramped object", default=-1, ge=-1
    )


class ClearPlan(Skill):
    """Choose an object to lift out, a grasp of it, and free places to set it down.

    The grasp is planned from the traced outline and the height alone: the object is unknown. Of the neighbours of the
    first object of `cramped` without which the fingers get enough space, the one that is carried least is taken out.
    With a stated candidate, that one is.

    SUCCESS: `plan` has the grasp for `grasp`, `places` the places for `set_down`, nearest first.
    """

    Params = ClearPlanParams
    params: ClearPlanParams

    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it computes

    NO_CLEAR = Failure(
        "no_clear",
        "no object can be taken out: none gives the fingers more space, can be grasped and has a free place",
        advice="push one aside with `nudge`, or take one out by hand",
    )

    known = In(tuple, "all candidates", key="candidates", element=Candidate)
    cramped = In(tuple, "indices of candidates that lack space for the fingers", element=int, required=False)
    map = In(SearchMap, "what has been explored", required=False, expected=False)
    plan = Out(GraspPlan, "the grasp of the object to take out, with alternatives")
    places = Out(tuple, "where to set it down, nearest first", element=FreePlace)

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        stated = self.params.candidate
        wanted = [c for index in self.cramped or () for c in self.known if c.index == index]
        if stated >= 0:
            wanted = [c for c in self.known if c.index == stated]
        if not wanted:
            raise self.NO_CLEAR(
                "no candidate is said to lack space" if stated < 0 else f"there is no candidate {stated}"
            )
        found = yield from self._plan(wanted[0], stated >= 0)
        if found is None:
            about = f"candidate {wanted[0].index} cannot be taken out" if stated >= 0 else (
                f"no neighbour of candidate {wanted[0].index} can be taken out so that it gets space"
            )  # fmt: skip
            raise self.NO_CLEAR(about)
        place = found.places[0]
        self.plan, self.places = found.grasp, found.places
        self.event(
            "clear_plan",
            candidate=place.candidate,
            shift_K_m=place.shift_K_m,
            turn_deg=float(np.rad2deg(place.turn_rad)),
            gap_m=place.gap_m,
            places=len(found.places),
            space_m=found.space_m,
        )

    def _plan(self, wanted: Candidate, itself: bool) -> Motion[Clearing | None]:
        """Return the plan; hold the arm for one period a step of the computation."""
        half_extent = 0.5 * np.array(self.context.world.container.interior_m[:2])
        gripper = self.context.arm.description.gripper
        planner = ClearPlanner(self.known, half_extent, gripper, obstacles(self.map))
        best: Clearing | None = None
        for found in planner.take_out(wanted) if itself else planner.for_space(wanted):
            best = found
            yield HOLD
        return best


def obstacles(belief: SearchMap | None) -> tuple[Neighbour, ...]:
    """Return what the search met and did not trace as an object: nothing is set down there."""
    untraced = [e.contour for e in belief.exclusions if not e.traced] if belief else []
    return tuple(Neighbour.within(-1, convex_hull(contour.outline_K_m(90))) for contour in untraced)
