"""Have candidates traced anew where closures met something that is not where it was traced."""

from __future__ import annotations

from glotouch_bt.perception.recognition import ProbeTouch
from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import In, Out, Skill, SkillParams, SkillRun


class MeasureAnewParams(SkillParams):
    """Parameters of `measure_anew`: none."""


class MeasureAnew(Skill):
    """Give up outline, top and closures of the doubtful candidates; `next_probe` then measures them again.

    A fingertip that comes down on something, or a hand that is pressed while the jaws close, says that the object was
    pushed, turned or toppled, or that its outline is wrong.

    SUCCESS: `anew` has the candidates to trace anew, maybe none.
    """

    Params = MeasureAnewParams
    params: MeasureAnewParams

    before_doubtful = In(tuple, "candidates on which closures met something", key="doubtful", required=False)
    before_probed = In(tuple, "measurements so far", key="probed", element=ProbeTouch, required=False, expected=False)
    felt = In(tuple, "closures so far", key="touchsets", element=TouchSet, required=False, expected=False)
    anew = Out(tuple, "indices of candidates to trace anew", element=int)
    given_up = Out(int, "number of candidates to trace anew")
    doubtful = Out(tuple, "none any more", element=int)
    probed = Out(tuple, "measurements of the other candidates", element=ProbeTouch)
    touchsets = Out(tuple, "closures on the other candidates", element=TouchSet)

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        self.anew, self.doubtful = self.before_doubtful or (), ()
        self.given_up = len(self.anew)
        self.probed = tuple(t for t in self.before_probed or () if t.candidate not in self.anew)
        self.touchsets = tuple(t for t in self.felt or () if t.candidate.index not in self.anew)
        self.event("measure_anew", candidates=self.anew)
