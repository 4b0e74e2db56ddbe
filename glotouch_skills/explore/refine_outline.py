"""Refine a coarse outline: descend where it is least certain, and trace until it is known well."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np

from glotouch_bt.perception.search import TraceParams, lost_among, of_another, refined, taken_by, trace_more
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.probe import Explorer, TracingParams

GAP_M = (0.004, 0.020)
"""Distances from the nearest contact at which the outline begins to count as unknown, and counts fully so. A limb in
the gap between contacts fits no family of outlines; with contacts all round, even their hull has the right centre."""


class RefineOutlineParams(TracingParams):
    """Parameters of `refine_outline`; contacts it had before count."""

    wall_gap_m: float = param(
        "Distance of the ball's centre from the walls", unit="m", default=0.012, ge=0.008, le=0.05
    )
    hop_m: float = param("Travel that a way over the top counts as", unit="m", default=0.2, ge=0.02, le=1.0)
    round_m: float = param("Longest way round the object to the next probe", unit="m", default=0.1, ge=0.02, le=1.0)

    def rule(self) -> TraceParams:
        """Return them as the trace plan takes them, closing the gaps between contacts also on the far side."""
        return replace(
            super().rule(), hop_m=self.hop_m, step_m=self.round_m, keen=2.0, odd_near_m=GAP_M[0], odd_far_m=GAP_M[1]
        )


class RefineOutline(Skill):
    """Refine a coarsely traced candidate until it can be squeezed and grasped.

    SUCCESS: `refined` is the candidate with its new contacts. An outline that is known well already stays unchanged.
    """

    PAUSE = "retreat"
    Params = RefineOutlineParams
    params: RefineOutlineParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "fingers"})}
    USES: ClassVar = frozenset({"arm"})

    NOT_MET = Failure(
        "not_met",
        "nothing was touched where the object should stand, or the trace ended on another object; `refined` "
        "is the candidate as it was",
        advice="it was pushed away, or is gone",
    )
    FAILURES: ClassVar = (*Explorer.FAILURES, MOTION_REFUSED)

    tool = In(HeldTool, "the held probe")
    candidate = In(Candidate, "the object as traced so far")
    known = In(tuple, "all candidates", key="candidates", element=Candidate, required=False, expected=False)
    refined = Out(Candidate, "the object as traced now", key="candidate", always=True)

    def run(self) -> SkillRun:
        """See the class."""
        p, tool, before = self.params, self.tool, self.candidate
        self.refined = before
        others = tuple(c for c in self.known or () if c.index != before.index)
        radius = tool.tip_radius_m if tool.round else 0.0
        explorer = Explorer(self.context, tool, p.speeds(), self.event)
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - p.wall_gap_m
        plan = trace_more(
            before.contacts,
            explorer.tip_K_m,
            tool.tip_radius_m,
            p.rule(),
            round_tip=tool.round,
            half_extent_m=half,
            columns=explorer.columns,
            elsewhere=partial(of_another, others, radius),
            taken=partial(taken_by, others, tool.tip_radius_m),
        )
        traced = yield from explorer.run(plan)
        better = refined(before, traced)
        if better is None:
            if traced.missing:
                raise self.NOT_MET(f"candidate {before.index} was not met again where it had been traced")
            return
        if lost_among(before, better, others):
            raise self.NOT_MET(
                f"candidate {before.index} was lost among others: what was traced is another one",
                advice="it stands too near to them to be traced from the side",
            )
        self.refined = better
        moved = float(np.linalg.norm(traced.displaced_K_m))
        explorer.distrust_free_space(better.contour, moved)
        self.event("candidate", candidate=self.refined, moved_m=moved, ended=traced.ended, moves=traced.moves)
