"""Forget candidates that are probably not where they were traced, so that their places are searched again."""

from __future__ import annotations

from dataclasses import replace

from glotouch_bt.perception.recognition import ProbeTouch
from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun

AROUND_M = 0.02
"""Distance around an outline, beyond the object's height, within which the object may stand or lie now. Source:
ours."""


class ForgetDoubtfulParams(SkillParams):
    """Parameters of `forget_doubtful`: none."""


class ForgetDoubtful(Skill):
    """Forget the doubtful candidates and what was searched around them, so that the search finds them where they are.

    A fingertip that comes down on something, or a hand that is pressed while the jaws close, says that the object was
    pushed, turned or toppled, or that its outline is wrong. A toppled object lies at most its height from its outline.

    SUCCESS: `candidates` and `map` have no doubtful candidate. A known number of objects is at least the number of the
    candidates before, so that the search goes on until the forgotten ones are found.
    """

    Params = ForgetDoubtfulParams
    params: ForgetDoubtfulParams

    NOTHING_SEARCHED = Failure("nothing_searched", "there is no map yet", advice="sweep first, with guarded_sweep")

    before = In(SearchMap, "what has been explored so far", key="map", required=False)
    known = In(tuple, "all candidates", key="candidates", element=Candidate, required=False)
    before_doubtful = In(tuple, "candidates on which closures met something", key="doubtful", required=False)
    before_probed = In(tuple, "measurements so far", key="probed", element=ProbeTouch, required=False, expected=False)
    felt = In(tuple, "closures so far", key="touchsets", element=TouchSet, required=False, expected=False)
    map = Out(SearchMap, "where to search now")
    candidates = Out(tuple, "the other candidates", element=Candidate)
    forgotten = Out(int, "number of candidates that were forgotten")
    doubtful = Out(tuple, "none any more", element=int)
    probed = Out(tuple, "measurements of the other candidates", element=ProbeTouch)
    touchsets = Out(tuple, "closures on the other candidates", element=TouchSet)

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        if self.before is None:
            raise self.NOTHING_SEARCHED("there is no map yet")
        doubtful = set(self.before_doubtful or ())
        gone = [c for c in self.known or () if c.index in doubtful]
        self.candidates = tuple(c for c in self.known or () if c.index not in doubtful)
        self.doubtful, self.forgotten = (), len(gone)
        self.probed = tuple(t for t in self.before_probed or () if t.candidate not in doubtful)
        self.touchsets = tuple(t for t in self.felt or () if t.candidate.index not in doubtful)
        if gone:
            indices = tuple(c.index for c in gone)
            self.event("forgotten", why="not where it was traced", candidates=indices)
            self.report(
                "Searched again",
                "Closures contradicted these outlines. They were forgotten, and their places were searched again.",
                ("forgotten candidates",),
                ((", ".join(map(str, indices)),),),
            )
        belief = self.before.only_with(self.candidates)
        for candidate in gone:
            belief = belief.unsearched(candidate.contour, candidate.height_m + AROUND_M)
            self.context.arm.felt.forget_free_near(candidate.contour.centre_K_m)
        if belief.expected is not None:
            belief = replace(belief, expected=max(belief.expected, belief.found + len(gone)))
        self.map = belief
