"""What was put back is not what it was taken for: forget what was felt of it, or leave it alone for good."""

from __future__ import annotations

from typing import ClassVar

from glotouch_bt.perception.touch import TouchSet
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.planning import GraspPlan


class RejectParams(SkillParams):
    """Parameters of `reject`."""

    most: int = param("So many objects may be taken in vain", default=2, ge=0, le=20)


class Reject(Skill):
    """Take the touches of the object that was put back out of what is known.

    An object that cannot be the target is not looked at again. One that was not where its touches said may be touched
    and taken once more; after that it is left alone, too.

    SUCCESS: `touchsets` holds the others; `rejected` names what is left alone.
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
    felt = In(tuple, "what was felt", key="touchsets", element=TouchSet)
    before_rejected = In(tuple, "indices of candidates left alone so far", key="rejected", required=False)
    before_doubted = In(tuple, "indices of candidates taken in vain so far", key="doubted", required=False)
    touchsets = Out(tuple, "what was felt of the others", element=TouchSet)
    rejected = Out(tuple, "indices of candidates left alone", element=int)
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
        if len(doubted) > self.params.most:
            raise self.WRONG_OBJECT(
                f"{len(doubted)} objects were taken and put back; candidate {index} was the last",
                taken=len(doubted),
                most=self.params.most,
            )
