"""Decide which squeezed candidate is the target."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar, Literal

from glotouch_bt import perception
from glotouch_bt.perception import recognition
from glotouch_bt.perception.recognition import Ranking
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD, BadInput
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.planning import TOO_LOW, GraspPlan, SoughtObject, find_target, plan_grasp

MAX_RIVAL = 0.05
"""Probability that another candidate is the target from which those that were put off are measured first. Source: ours;
another object was taken for the truck with 0.89 while the truck, with 0.09, had been put off (`bench retrieve --world
touching_five --conditions realistic`, seed 59642, c7043584)."""


def in_words(ranking: Ranking) -> str:
    """Return which candidate is the target."""
    best = ranking.best
    share = "" if math.isnan(best.probability) else f" with a probability of {100 * best.probability:.1f} %"
    return f"candidate {best.index} is the target{share}"


class MatchParams(SkillParams):
    """Parameters of `match`."""

    target: str = param(
        "The object to find: an STL file, the name of one in the world's object folder, or touched:NAME", names="stl"
    )
    matcher: Literal["likelihood", "paper"] = param("Method of comparing candidates", default="likelihood")


class MatchTarget(Skill):
    """Rank all TouchSets against the target's STL and plan the grasp of the best candidate.

    It does not accept a candidate while another one may be the target (`MAX_RIVAL`) and the probe has not measured all
    that may be.

    SUCCESS: the best candidate is the target with enough certainty and evidence; `plan` is its grasp.
    """

    Params = MatchParams
    params: MatchParams

    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it computes

    NOT_RECOGNISED = Failure(
        "not_recognised", "no candidate is surely the target; `ranking` is written", advice="touch more"
    )
    TOO_WIDE = Failure(
        "too_wide",
        "no candidate is surely the target, and the jaws do not open wide enough for it",
        advice="use a wider gripper",
    )
    NO_TOUCH = Failure(
        "no_touch",
        "nothing was squeezed",
        advice="squeeze the candidates first; the squeezes' own failures say why none was felt",
    )
    FAILURES: ClassVar = (TOO_LOW,)

    touchsets = In(tuple, "one TouchSet for each squeezed candidate", element=TouchSet, required=False)
    known = In(
        tuple, "all candidates, to say which were not squeezed", key="candidates", element=Candidate, required=False
    )
    rejected = In(tuple, "indices of candidates that are not the target", required=False)
    postponed = In(
        int, "number of candidates that may be the target and are not measured yet", required=False, expected=False
    )
    recognised = Out(bool, "one is surely the target", always=True)
    ranking = Out(Ranking, "all candidates, best first", result=in_words)
    plan = Out(GraspPlan, "how to grasp the best one")

    def run(self) -> SkillRun:
        """See the class."""
        self.recognised = False
        rejected = self.rejected or ()
        touchsets = tuple(t for t in self.touchsets or () if t.candidate.index not in rejected)
        if not touchsets:
            raise self.NO_TOUCH(
                "no candidate was squeezed, so nothing can be recognised",
                candidates=len(self.known or ()),
                rejected=len(rejected),
            )
        yield HOLD  # matching takes longer than a control period; on hardware the arm holds meanwhile
        gripper = self.context.arm.description.gripper
        target = find_target(self.params.target, self.context.world.objects, gripper)
        model = target.model
        if model.certainty is not None and self.params.matcher == "paper":
            raise BadInput("matcher paper: needs an STL; use the matcher likelihood for a target known by touch")
        ranking = self._all_measured(recognition.MATCHERS[self.params.matcher](model, touchsets))
        self.ranking = ranking = self._told_of_twins(ranking, target)
        self.event("ranking", target=target.name, ranking=ranking, gates=ranking.gates, matcher=self.params.matcher)
        if not ranking.accepted:
            felt = {t.candidate.index for t in touchsets} | set(rejected)
            missed = [str(c.index) for c in self.known or () if c.index not in felt]
            why = "; ".join(ranking.reasons) + (f"; not squeezed: candidate {', '.join(missed)}" if missed else "")
            if fault := perception.too_wide(model, gripper):
                raise self.TOO_WIDE(f"{fault} ({why})", narrowest_m=model.narrowest_m)
            raise self.NOT_RECOGNISED(
                f"no candidate is surely {target.name}: {why}", advice=_advice(ranking), margin=ranking.margin
            )
        self.recognised = True
        best = next(t for t in touchsets if t.candidate.index == ranking.best.index)
        quat = ranking.best.quat
        self.plan = plan_grasp(best, ranking.best, target.standing(quat), model.standing(quat), gripper)
        self.event("plan", plan=self.plan)

    def _all_measured(self, ranking: Ranking) -> Ranking:
        """Refuse the best candidate if one that was put off may be the target instead."""
        rivals = sum(m.probability for m in ranking.matches if m.index != ranking.best.index)
        if not (ranking.accepted and self.postponed and rivals >= MAX_RIVAL):  # without probabilities they are NaN
            return ranking
        why = f"another candidate is the target with probability {rivals:.2f}; not yet measured: {self.postponed}"
        return replace(ranking, accepted=False, reasons=(*ranking.reasons, why))

    def _told_of_twins(self, ranking: Ranking, target: SoughtObject) -> Ranking:
        """Say which objects of the box have exactly the target's shape: nobody can tell them apart by touch."""
        twins = target.twins
        if not twins:
            return ranking
        what = f"{', '.join(twins)} {'has' if len(twins) == 1 else 'have'} exactly the shape of the target"
        self.event("note", text=what)
        return ranking if ranking.accepted else replace(ranking, reasons=(*ranking.reasons, what))


def _advice(ranking: Ranking) -> str:
    """Return the advice with the most informative next touch."""
    c = ranking.next_touch
    if c is None:
        return "touch more"
    yaw = math.degrees(math.remainder(c.yaw_K_rad, math.pi))
    return f"touch candidate {c.candidate} {c.height_m * 1e3:.0f} mm above the floor, hand turned to {yaw:.0f} degrees"
