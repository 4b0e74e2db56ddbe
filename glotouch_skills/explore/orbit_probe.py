"""Trace a touched object: probe it where its outline is least certain, until the outline is known."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.perception.search import Move, SearchMap, SearchPlan, left_in_words, trace_bodies
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillRun, param
from glotouch_bt.skill.probing import HeldTool
from glotouch_skills.common.probe import Explorer, TracingParams

NEAR_M = 0.015
"""Farther than this from the first contact, the ball returns to it from above: a preempted trace may have left the ball
on the object's other side."""


class OrbitProbeParams(TracingParams):
    """Parameters of `orbit_probe`: a coarse outline, so that the next object is found soon."""

    centre_sd_m: float = param(
        "Enough is known when the centre's standard deviation is below this", unit="m", default=0.006, gt=0.0, le=0.02
    )
    radial_sd_m: float = param(
        "... and the outline's, in every direction, below this", unit="m", default=0.0225, gt=0.0, le=0.03
    )
    max_contacts: int = param("Most contacts", default=9, ge=3, le=60)
    exclusion_m: float = param("Margin round a traced object that the search keeps out of", unit="m", default=0.010,
                               ge=0.0, le=0.05)  # fmt: skip


class OrbitProbe(Skill):
    """Trace a candidate from its first contact: centre, outline and displacement. `touch_top` measures its height.

    Make contacts where the outline is least certain for the distance, until the fit's covariance is small enough. Set
    aside a contact that cannot belong to the object. The defaults give a coarse outline, so that the next object is
    found soon; `refine_outline` refines it once all are found. A contour that two bodies explain better than one gives
    two candidates. Doubtful candidates are traced further before the search ends by count.

    SUCCESS: `candidates` has a new candidate, or a better outline of a partly traced one; the map excludes its
    envelope.
    """

    PAUSE = "retreat"
    Params = OrbitProbeParams
    params: OrbitProbeParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "fingers"})}
    USES: ClassVar = frozenset({"arm"})

    KNOWN_OBJECT = Failure(
        "known_object",
        "the contact belongs to an object traced before; its place is dropped from the search",
        advice="sweep on: its place is dropped from the search",
    )
    NOT_TRACED = Failure(
        "not_traced",
        "too few contacts were made to fit an outline",
        advice="raise the sensing height if the object is flat",
    )
    FAILURES: ClassVar = (*Explorer.FAILURES, MOTION_REFUSED)

    tool = In(HeldTool, "the held probe")
    contact = In(Contact, "first contact with the object")
    previous_map = In(SearchMap, "the search map", key="map")
    previous = In(tuple, "candidates so far", key="candidates", required=False)
    map = Out(SearchMap, "the search map with the object excluded")
    candidates = Out(tuple, "candidates, the new one last", element=Candidate)
    found = Out(int, "number of traced objects")
    complete = Out(bool, "all expected objects are traced beyond doubt; of an unknown number, hardly one is left")
    chance_left = Out(
        float, "chance that an object of at least 15 mm is left; nan with a known number", result=left_in_words
    )

    def run(self) -> SkillRun:
        """See the class."""
        p, belief, first = self.params, self.previous_map, self.contact
        known: tuple[Candidate, ...] = self.previous or ()
        self.candidates, self.found, self.complete = known, len(known), belief.complete
        self.chance_left = belief.chance_left
        if belief.knows(first):
            self.map = belief.with_dropped(first.point_K_m)
            raise self.KNOWN_OBJECT(
                "the contact lies on an object that is traced already",
                x_K_m=float(first.point_K_m[0]),
                y_K_m=float(first.point_K_m[1]),
            )
        explorer = Explorer(self.context, self.tool, p.speeds(), self.event)
        if float(np.linalg.norm(explorer.tip_K_m - first.tip_K_m[:2])) > NEAR_M:
            yield from explorer.run(_back_to(first, p.clearance_m))
        plan = trace_bodies(
            belief,
            known,
            first,
            explorer.tip_K_m,
            self.tool.tip_radius_m,
            p.rule(),
            p.height_m,
            p.exclusion_m,
            round_tip=self.tool.round,
        )
        admitted, traced = yield from explorer.run(plan)
        self.map = admitted.belief
        if admitted.index is None:
            raise self.NOT_TRACED(
                f"{len(traced.contacts)} contacts: no outline fits; {traced.ended}", contacts=len(traced.contacts)
            )
        candidates = {c.index: c for c in admitted.candidates}
        for index in admitted.changed:
            displaced_m = float(np.linalg.norm(traced.displaced_K_m))
            explorer.distrust_free_space(candidates[index].contour, displaced_m)
            self.event(
                "candidate",
                candidate=candidates[index],
                displaced_m=displaced_m,
                ended=traced.ended,
                moves=traced.moves,
            )
        self.candidates = admitted.candidates
        self.found, self.complete = len(admitted.candidates), self.map.complete
        self.chance_left = self.map.chance_left


def _back_to(first: Contact, clearance_m: float) -> SearchPlan[None]:
    """Move over the object, and down again beside its first contact."""
    yield Move("hop", first.tip_K_m[:2] - clearance_m * first.approach_K[:2])
