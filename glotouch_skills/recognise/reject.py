"""Handle an object that was put back because it is not the target: drop its touches, or reject it for good."""

from __future__ import annotations

from typing import ClassVar

from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.planning import GraspPlan


class RejectParams(SkillParams):
    """Parameters of `reject`."""

    max_rejected: int = param("Largest number of objects taken in vain", default=2, ge=0, le=20)


class Reject(Skill):
    """Remove the touches of the object that was put back.

    An object that cannot be the target is rejected. One that did not match its touches may be touched and taken once
    more; after that it is rejected, too.

    SUCCESS: `touchsets` has the other objects; `rejected` has the rejected ones.
    """

    Params = RejectParams
    params: RejectParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty"})}

    WRONG_OBJECT = Failure(
        "wrong_object",
        "too many objects were taken in vain",
        advice="the target may not be there, or another object is much like it",
    )

    made = In(GraspPlan, "how it was taken")
    impossible = In(bool, "it cannot be the target")
    felt = In(tuple, "touches so far", key="touchsets", element=TouchSet)
    before_rejected = In(tuple, "indices of candidates rejected so far", key="rejected", required=False)
    before_doubted = In(tuple, "indices of candidates taken in vain so far", key="doubted", required=False)
    touchsets = Out(tuple, "touches of the others", element=TouchSet)
    rejected = Out(tuple, "indices of rejected candidates", element=int)
    doubted = Out(tuple, "indices of candidates taken in vain", element=int)

    def run(self) -> SkillRun:
        """See the class."""
        yield HOLD
        index = self.made.candidate
        doubted: tuple[int, ...] = (*(self.before_doubted or ()), index)
        rejected: tuple[int, ...] = self.before_rejected or ()
        if (self.impossible or doubted.count(index) > 1) and index not in rejected:
            rejected = (*rejected, index)
        self.doubted, self.rejected = doubted, rejected
        self.touchsets = tuple(t for t in self.felt if t.candidate.index != index)
        self.event("reject", candidate=index, rejected=rejected)
        if len(doubted) > self.params.max_rejected:
            raise self.WRONG_OBJECT(
                f"{len(doubted)} objects were taken and put back; candidate {index} was the last",
                taken=len(doubted),
                max_rejected=self.params.max_rejected,
            )
