"""Choose outlines that cannot be right, so that the search traces them anew."""

from __future__ import annotations

from dataclasses import replace

from glotouch_bt.perception.recognition import ProbeTouch
from glotouch_bt.perception.search import SearchMap, contradictions
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param

AROUND_M = 0.02
"""Distance around such an outline within which the floor is searched again. Source: ours; objects that are traced
move by up to 20 mm."""
MISSING = "fewer objects are known than expected"
"""Why the search goes on without a wrong outline."""


class TraceAnewParams(SkillParams):
    """Parameters of `trace_anew`."""

    times: int = param("Largest number of times that the search goes on", default=2, ge=0, le=20)


class TraceAnew(Skill):
    """Choose the outlines that cannot be right although they were refined, so that the search traces them anew.

    Such an outline is uncertain, too narrow for an object, overlaps another one, or does not fit its contacts. A trace
    that passes on to a neighbour leaves it, and so does an object that is pushed while it is traced: further contacts
    do not mend it. The search goes back to where it was touched, and traces it with new contacts only. Until then, it
    is not among `candidates`, but record and report still show it. The new outline gets its index. The search goes on,
    too, if fewer candidates are left than objects are expected: two of them turned out to be one body. With as many
    candidates as objects, it does not.

    SUCCESS: `candidates` and `map` have no such outline. `search_done` is true if there was none and no object is
    missing, or if the search went on often enough.
    """

    Params = TraceAnewParams
    params: TraceAnewParams

    NOTHING_SEARCHED = Failure("nothing_searched", "there is no map yet", advice="sweep first, with guarded_sweep")

    before = In(SearchMap, "what has been explored so far", key="map", required=False)
    known = In(tuple, "all candidates", key="candidates", element=Candidate, required=False)
    before_probed = In(tuple, "measurements so far", key="probed", element=ProbeTouch, required=False)
    before_retraced = In(tuple, "why the search went on so far", key="retraced", element=tuple, required=False)
    map = Out(SearchMap, "where to search now")
    candidates = Out(tuple, "the other candidates", element=Candidate)
    probed = Out(tuple, "measurements of the other candidates", element=ProbeTouch)
    search_done = Out(bool, "the search need not go on")
    retraced = Out(tuple, "why the search went on so far, as in the report", element=tuple)

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        if self.before is None:
            raise self.NOTHING_SEARCHED("there is no map yet")
        known, probed, rows = self.known or (), self.before_probed or (), self.before_retraced or ()
        belief = self._without_lost(self.before.only_with(known), known)
        refined = {t.candidate for t in probed if t.part == "outline"}
        wrong = contradictions([c for c in known if c.index in refined])
        missing = belief.expected is not None and belief.found < belief.expected
        times = len({row[0] for row in rows})
        self.search_done = not (wrong or missing) or times >= self.params.times
        self.map, self.candidates, self.probed, self.retraced = belief, known, probed, rows
        if self.search_done:
            return
        gone = tuple(c for c in known if c.index in wrong)
        self.candidates = tuple(c for c in known if c.index not in wrong)
        self.probed = tuple(t for t in probed if t.candidate not in wrong)
        belief = replace(belief.only_with(self.candidates), to_replace=gone)
        for candidate in gone:
            belief = belief.unsearched(candidate.contour, AROUND_M)
            belief = belief.with_hints((*belief.hints, *reversed(candidate.contacts)))
            self.context.arm.felt.forget_free_near(candidate.contour.centre_K_m)
            self.event("note", text=f"candidate {candidate.index} is traced anew: {wrong[candidate.index]}")
        self.map = belief
        reasons = [(str(i), why) for i, why in wrong.items()] or [("-", MISSING)]
        self.retraced = (*rows, *((str(times + 1), *reason) for reason in reasons))
        self.report(
            "Traced anew",
            "These outlines could not be right, so the search went on with new contacts only.",
            ("round", "candidate", "why"),
            self.retraced,
        )

    def _without_lost(self, belief: SearchMap, known: tuple[Candidate, ...]) -> SearchMap:
        """Return the map without candidates to be traced anew; record those that were not found again."""
        there = {c.index for c in known}
        if lost := [c.index for c in belief.to_replace if c.index not in there]:
            self.event("forgotten", why="nothing was found there when it was to be traced anew", candidates=lost)
        return replace(belief, to_replace=())
