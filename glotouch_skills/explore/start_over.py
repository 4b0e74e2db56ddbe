"""Forget what was found, if it contradicts itself, so that the search begins again."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from glotouch_bt.perception.search import SearchMap, contradictions
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param


class StartOverParams(SkillParams):
    """Parameters of `start_over`."""

    expected_objects: Annotated[int, Field(ge=1, le=20)] | Literal["unknown"] = param(
        "Number of objects in the container, as for `guarded_sweep`", default=5
    )
    times: int = param("Largest number of times that it forgets everything", default=1, ge=0, le=20)


class StartOver(Skill):
    """Forget map, candidates and touches, if they cannot all be right.

    They cannot if two outlines overlap, because bodies do not, if an outline is narrower than any object or still
    uncertain, or if contacts do not fit their outline. Objects that are pushed while they are traced leave such maps,
    and tracing some of them again does not mend them.

    SUCCESS: everything is forgotten. New candidates get new indices.
    """

    Params = StartOverParams
    params: StartOverParams

    CONSISTENT = Failure(
        "consistent",
        "what was found does not contradict itself, or was forgotten often enough; it is kept",
        advice="the target may not be there, or differs from its STL file",
    )

    before = In(SearchMap, "what has been explored so far", key="map", required=False)
    known = In(tuple, "all candidates", key="candidates", element=Candidate, required=False)
    times_before = In(int, "how often everything was forgotten so far", key="times_forgotten", required=False)
    map = Out(SearchMap, "a map without any exploration")
    candidates = Out(tuple, "none", element=Candidate)
    touchsets = Out(tuple, "none", element=TouchSet)
    doubtful = Out(tuple, "none", element=int)
    times_forgotten = Out(int, "how often everything was forgotten so far")

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        candidates: tuple[Candidate, ...] = self.known or ()
        wrong = contradictions(candidates)
        why = "; ".join(f"candidate {index}: {what}" for index, what in wrong.items())
        times = self.times_before or 0
        if self.before is None or not why or times >= self.params.times:
            raise self.CONSISTENT(why or "the outlines do not overlap and are known", times=times)
        expected = None if self.params.expected_objects == "unknown" else self.params.expected_objects
        self.map = self.before.forgotten(expected, candidates)
        self.candidates, self.touchsets, self.doubtful = (), (), ()
        self.times_forgotten = times + 1
        self.context.arm.felt.forget()
        indices = tuple(c.index for c in candidates)
        self.event("forgotten", why=why, candidates=indices)
        self.report(
            "Begun again",
            "What was found contradicted itself. It was forgotten, and the search began again.",
            ("forgotten candidates", "why"),
            ((", ".join(map(str, indices)), why),),
        )
