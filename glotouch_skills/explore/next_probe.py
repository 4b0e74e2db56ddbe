"""Choose what the probe measures next: the outline or the top of a candidate."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.perception import joined, recognition
from glotouch_bt.perception.recognition import PARTS, ProbeOption, ProbeTouch, TargetModel, excluded, next_probe_touch
from glotouch_bt.perception.search import distinct, separated
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD, Array
from glotouch_bt.skill import Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.planning import TOO_LOW, find_target

PART_S = {"outline": 17.0, "top": 17.0}
"""Robot time of `refine_outline` and `touch_top` on one candidate. Source: measured, mean of 60 nominal missions."""
TRAVEL_M_S = 0.1
"""Speed on the way to a candidate."""


class NextProbeParams(SkillParams):
    """Parameters of `next_probe`."""

    target: str = param(
        "The object wanted: an STL file, the name of one in the world's object folder, or touched:NAME; "
        "empty: measure everything",
        default="",
        names="stl",
    )
    outlines_only: bool = param("Without a target, leave the tops for later", default=False)


class NextProbe(Skill):
    """Choose the measurement that is expected to tell most per second about which candidate is the target.

    Repeat it, and make what it chose with `refine_outline` or `touch_top`, until `measured_enough`. A candidate that
    the target's STL excludes already is not measured. One that is probably not needed is put off, but only until the
    jaws have been used. Without a target all are measured, the least certain outline first, and the tops last.

    Contacts pass to the candidate that explains them better: a trace may have passed on to a neighbour. Two candidates
    that are one body become one in `candidates`: they overlap, or they are parts of the target. One without a top is
    left out: the object was moved, and another candidate was traced where it stands, or will be.

    SUCCESS: `candidate` and `next_part` are chosen, or `measured_enough` is true and `next_part` is empty.
    """

    Params = NextProbeParams
    params: NextProbeParams

    USES: ClassVar = frozenset({"arm"})  # it holds the arm while it computes

    NO_CANDIDATES = Failure("no_candidates", "there is nothing to measure", advice="explore first")
    FAILURES: ClassVar = (TOO_LOW,)

    tool = In(HeldTool, "the held probe; contacts of another section stay as they are", required=False, expected=False)
    known = In(tuple, "all candidates", key="candidates", element=Candidate, required=False)
    measured = In(Candidate, "the candidate measured last", key="candidate", required=False)
    chosen = In(str, "what was measured last; nothing yet", key="next_part", required=False)
    gone = In(bool, "nothing stands where the last one was traced", required=False, expected=False)
    felt = In(tuple, "closures so far", element=TouchSet, required=False, expected=False)
    before = In(tuple, "measurements tried so far", key="probed", element=ProbeTouch, required=False)
    candidates = Out(tuple, "all candidates, with what was measured last", element=Candidate)
    candidate = Out(Candidate, "the candidate to measure")
    next_part = Out(str, 'what to measure of it: "outline", "top", or nothing')
    probed = Out(tuple, "measurements tried, with the one chosen now", element=ProbeTouch)
    measured_enough = Out(bool, "no measurement is left that is worth its time")
    postponed = Out(int, "number of candidates that may be the target and are not measured yet")
    unmeasured = Out(int, "number of all candidates that are not measured yet")

    def run(self) -> SkillRun:
        """See the class."""
        if not self.known:
            raise self.NO_CANDIDATES("there is no candidate to measure")
        yield HOLD  # the computation takes longer than a control period; on hardware the arm holds meanwhile
        new, before = self.measured if self.chosen else None, self.before or ()
        candidates = tuple(new if new is not None and new.index == c.index else c for c in self.known)
        if new is not None and self.gone and self.chosen == "top" and len(candidates) > 1:
            there = tuple(c for c in candidates if c.index != new.index)
            self._leave_out(candidates, there, "nothing stands where it was traced")
            candidates = there
        model = self._target()
        candidates = self._distinct(candidates, model)
        topped = {c.index for c in candidates if c.top_touched}
        lost = {c.index for c in self.known if c.top_touched} - topped  # what was touched there was another body
        before = tuple(t for t in before if t.part != "top" or t.candidate not in lost)
        tried = {(t.candidate, t.part) for t in before}
        parts = PARTS[:1] if self.params.outlines_only and model is None else PARTS
        left = [ProbeTouch(c.index, part) for c in candidates for part in parts if (c.index, part) not in tried]
        self.postponed = 0
        touch = _worst_known(candidates, left) if model is None else self._by_target(model, candidates, left)
        self.candidates, self.measured_enough = candidates, touch is None
        self.unmeasured = len(_indices(left))
        self.next_part = "" if touch is None else touch.part
        self.probed = before if touch is None else (*before, touch)
        self.candidate = next(c for c in candidates if touch is None or c.index == touch.candidate)

    def _target(self) -> TargetModel | None:
        if not self.params.target:
            return None
        return find_target(self.params.target, self.context.world.objects, self.context.arm.description.gripper).model

    def _distinct(self, candidates: tuple[Candidate, ...], model: TargetModel | None) -> tuple[Candidate, ...]:
        """Return the candidates, each with the contacts that are probably its own, without those that turned out to be
        the same body as another one, or a part of the target with another one."""
        felt = frozenset(t.candidate.index for t in self.felt or () if t.layers)
        radius_m = self.tool.tip_radius_m if self.tool is not None and self.tool.round else 0.0
        apart = separated(candidates, radius_m, felt)
        kept = distinct(apart, felt)
        self._leave_out(candidates, kept, "the same body as another one")
        whole = kept if model is None else joined(model, kept, felt)
        self._leave_out(kept, whole, "with another one it is one body, the target's")
        altered = [c for c in whole if not any(c is old for old in candidates)]
        if altered:
            names = ", ".join(str(c.index) for c in altered)
            self.event("note", text=f"contacts were shared out anew among candidates {names}")
        for candidate in altered:
            self.event("candidate", candidate=candidate)
        return whole

    def _leave_out(self, before: tuple[Candidate, ...], after: tuple[Candidate, ...], why: str) -> None:
        """Record which candidates are left out, so that reports and views no longer show them as objects."""
        if gone := sorted({c.index for c in before} - {c.index for c in after}):
            self.event("forgotten", why=why, candidates=gone)

    def _by_target(
        self, model: TargetModel, candidates: tuple[Candidate, ...], left: list[ProbeTouch]
    ) -> ProbeTouch | None:
        felt = {t.candidate.index: t.sequences for t in self.felt or ()}
        touchsets = tuple(TouchSet(c, felt.get(c.index, ())) for c in candidates)
        belief = recognition.infer_belief(model, touchsets)
        options = [self._option(c, left) for c in candidates if c.index in _indices(left)]
        chosen = next_probe_touch(belief, options, can_wait=self.felt is None)
        out = excluded(belief)
        self.postponed = len(_indices(left) - out)
        why = "most expected gain per second" if chosen else "every other candidate is excluded"
        if chosen is None and self.postponed:
            why = "the jaws first: one of those measured is probably the target"
        self.event(
            "next_probe",
            touch=chosen.touch if chosen else None,
            seconds=chosen.seconds if chosen else 0.0,
            why=why,
            probability={m.index: m.probability for m in belief.ranking.matches},
            p_absent=belief.ranking.p_absent,
            excluded=sorted(out),
        )
        return chosen.touch if chosen else None

    def _option(self, candidate: Candidate, left: list[ProbeTouch]) -> ProbeOption:
        """Return what is left to measure of a candidate, with the way to it."""
        arm, container = self.context.arm, self.context.world.container
        here: Array = container.pose_B_K.inverse().apply(arm.pose_B_P.position_m)[:2]
        way_s = float(np.linalg.norm(candidate.contour.centre_K_m - here)) / TRAVEL_M_S
        first, *then = (t for t in left if t.candidate == candidate.index)
        if not then:
            return ProbeOption(first, way_s + PART_S[first.part])
        return ProbeOption(first, way_s + PART_S[first.part], then[0], PART_S[then[0].part])


def _indices(touches: list[ProbeTouch]) -> set[int]:
    return {t.candidate for t in touches}


def _worst_known(candidates: tuple[Candidate, ...], left: list[ProbeTouch]) -> ProbeTouch | None:
    """Return the next measurement of all: the outlines, the least certain one first, and then the tops."""
    quality = {c.index: c.quality for c in candidates}
    return min(left, key=lambda t: (PARTS.index(t.part), quality[t.candidate]), default=None)
