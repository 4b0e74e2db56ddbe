"""Trace on what was traced in haste: from above, where its outline is least certain, until it is known well."""

from __future__ import annotations

import dataclasses

import numpy as np

from glotouch_bt.search import TraceParams, trace_more
from glotouch_bt.touch import Candidate, contour_quality
from skills.base import In, Out, Skill, SkillFailed, SkillParams, SkillRun, param
from skills.exploring import Explorer, ExploringSpeeds
from skills.held_tool import HeldTool


class RefineOutlineParams(SkillParams):
    """Parameters of `refine_outline`."""

    clearance_m: float = param("Ball to outline while going round", unit="m", default=0.005, ge=0.003, le=0.03)
    centre_sd_m: float = param(
        "Enough is known when the centre's standard deviation is below this", unit="m", default=0.0010, gt=0.0, le=0.02
    )
    radial_sd_m: float = param(
        "... and the outline's, in every direction, below this", unit="m", default=0.004, gt=0.0, le=0.03
    )
    most_contacts: int = param("Most contacts, those it had included", default=14, ge=3, le=60)
    orbit_speed_m_s: float = param("Speed beside the object", unit="m/s", default=0.05, gt=0.0, le=0.08)
    probe_speed_m_s: float = param("Probing speed", unit="m/s", default=0.03, gt=0.0, le=0.06)
    lower_speed_m_s: float = param("Speed down beside it", unit="m/s", default=0.02, gt=0.0, le=0.06)
    height_m: float = param("Ball centre above the floor while tracing", unit="m", default=0.018, ge=0.009, le=0.06)
    wall_gap_m: float = param("Ball centre kept from the walls", unit="m", default=0.012, ge=0.008, le=0.05)


class RefineOutline(Skill):
    """From a candidate known well enough to find it again to one known well enough to squeeze and to grasp.

    SUCCESS: `refined` is the candidate with what its new contacts say. An outline known well already is left as it is.
    FAILURE `not_met`: nothing was touched where it should stand; `refined` is the candidate as it was.
    FAILURE `hard_contact`, `tool_lost`: as for `orbit_probe`.
    """

    Params = RefineOutlineParams
    params: RefineOutlineParams
    tool = In(HeldTool, "the held probe")
    candidate = In(Candidate, "the object as traced so far")
    refined = Out(Candidate, "the object as traced now", key="candidate", always=True)

    def run(self) -> SkillRun:
        """See the class."""
        p, tool, before = self.params, self.tool, self.candidate
        self.refined = before
        speeds = ExploringSpeeds(
            step_m_s=p.orbit_speed_m_s, probe_m_s=p.probe_speed_m_s, lower_m_s=p.lower_speed_m_s, height_m=p.height_m
        )
        explorer = Explorer(self.context, tool, speeds, self.event)
        params = TraceParams(
            clearance_m=p.clearance_m,
            centre_sd_m=p.centre_sd_m,
            radial_sd_m=p.radial_sd_m,
            most_contacts=p.most_contacts,
        )
        half = 0.5 * np.array(self.context.world.container.interior_m[:2]) - p.wall_gap_m
        plan = trace_more(
            before.contacts, explorer.tip_K_m, tool.tip_radius_m, params, round_tip=tool.round, half_extent_m=half
        )
        traced = yield from explorer.run(plan)
        if traced.outline is None or len(traced.contacts) == len(before.contacts):
            if traced.missing:
                raise SkillFailed(
                    "not_met",
                    f"candidate {before.index} was not met again where it had been traced",
                    advice="it was pushed away, or is gone",
                )
            return
        contour = traced.outline.contour
        tips = np.array([c.tip_K_m[:2] for c in traced.contacts])
        self.refined = dataclasses.replace(
            before, contour=contour, contacts=traced.contacts, quality=contour_quality(tips, contour)
        )
        moved = float(np.linalg.norm(traced.displaced_K_m))
        self.event("candidate", candidate=self.refined, moved_m=moved, ended=traced.ended)
