"""Where contacts at one height leave an outline ambiguous: a second ring of contacts at another height."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from glotouch_bt.perception.search import TraceParams, outline_of, trace_ring, with_second_ring
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.perception.touch.outline import ambiguous, ring_height_m
from glotouch_bt.skill import In, Out, Skill, SkillRun, param
from glotouch_skills.common.probe import Explorer, HeldTool, TracingParams


class SecondRingParams(TracingParams):
    """Parameters of `second_ring`; `height_m` is the first ring's, and its own follows from the touched top."""

    share: float = param("Its height, as a share of the touched top's", default=0.6, gt=0.0, lt=1.0)
    apart_m: float = param("... at least so far above the first ring", unit="m", default=0.012, ge=0.005, le=0.1)
    clear_m: float = param("... and so far below the top", unit="m", default=0.010, ge=0.006, le=0.05)
    max_contacts: int = param("Most contacts of the second ring", default=10, ge=4, le=60)
    wall_gap_m: float = param("Ball centre kept from the walls", unit="m", default=0.012, ge=0.008, le=0.05)
    hop_m: float = param("A way over the top counts as so much travel", unit="m", default=0.1, ge=0.02, le=1.0)

    def rule(self) -> TraceParams:
        """As the plans take them."""
        return replace(super().rule(), hop_m=self.hop_m, keen=2.0)


class SecondRing(Skill):
    """From a candidate of known height to one whose centre both heights have a say in, if one height is ambiguous.

    Ambiguous: no family of outlines explains the contacts to within their scatter, or those that do differ about the
    centre. No shipped mission but `survey_two_heights` has it: sections wander farther from one height to another than
    the contacts at one err (docs/results.md).

    SUCCESS: `ringed` is the candidate with the second ring, or as it was: nothing is ambiguous, there is no room
    between the first ring and the top, or nothing was met up there.
    FAILURE `hard_contact`, `tool_lost`: as for `orbit_probe`.
    """

    PAUSE = "retreat"
    Params = SecondRingParams
    params: SecondRingParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "fingers"})}
    USES: ClassVar = frozenset({"arm"})
    FAILURES: ClassVar = {
        "hard_contact": "the wrench passed a hard limit on the way",
        "tool_lost": "the jaws are not as far apart as when they took the tool",
        "motion_refused": "the way is not clear",
    }

    tool = In(HeldTool, "the held probe")
    candidate = In(Candidate, "the object, its height touched", key="measured")
    ringed = Out(Candidate, "the object as both heights have it", key="measured", always=True)

    def run(self) -> SkillRun:
        """See the class."""
        p, tool, before = self.params, self.tool, self.candidate
        self.ringed = before
        if before.rings or not before.contacts:
            return
        why = ambiguous(outline_of(before.contacts, tool.tip_radius_m if tool.round else 0.0))
        lower_m = float(np.median([c.tip_K_m[2] for c in before.contacts])) - tool.floor_z_K_m
        height_m = ring_height_m(before.height_m, lower_m, p.share, p.apart_m, p.clear_m)
        if not why or height_m is None:
            return
        explorer = Explorer(self.context, tool, replace(p.speeds(), height_m=height_m), self.event)
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - p.wall_gap_m
        plan = trace_ring(
            before, explorer.tip_K_m, tool.tip_radius_m, p.rule(), round_tip=tool.round, half_extent_m=half
        )
        traced = yield from explorer.run(plan)
        after = None if traced is None else with_second_ring(before, traced, height_m, lower_m)
        if traced is None or after is None:
            self.event("note", text=f"candidate {before.index}: nothing was met {height_m * 1e3:.0f} mm up")
            return
        self.ringed = after
        moved = float(np.linalg.norm(traced.displaced_K_m))
        self.event("candidate", candidate=after, moved_m=moved, ended=traced.ended, why=why, ring_height_m=height_m)
