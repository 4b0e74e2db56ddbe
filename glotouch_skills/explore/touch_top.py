"""Measure the height of a traced object by touching its top."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np

from glotouch_bt.motion import FREE_M_S, Motion
from glotouch_bt.perception.search import BallMove, BallOutcome, TopPlan, TopRule, rounds, top_plan
from glotouch_bt.perception.touch import Candidate, GuardParams
from glotouch_bt.robot import Array, MotionRefused
from glotouch_bt.skill import MOTION_REFUSED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_bt.skill.probing import HeldTool, Prober
from glotouch_skills.common.probe import drive

RIM_PLACES = 4
"""Number of places on the rim of a hollow object to touch, evenly spaced."""
RIM_INSET_M = 0.003
"""Distance of these places inside the rim."""
INSET_SHARE = 0.3
"""Distance of the passes inside the outline over half its width: passes in the middle of a narrow object miss what
stands at its edge. Source: ours."""
MIN_REACH_M = 0.003
"""Least distance of inner places from the passes of a narrow object. Source: ours; as the parameter `reach_m`."""


class TouchTopParams(SkillParams):
    """Parameters of `touch_top`."""

    down_speed_m_s: float = param("Speed down onto the top", unit="m/s", default=0.02, gt=0.0, le=0.06)
    pass_speed_m_s: float = param("Speed of the passes above it", unit="m/s", default=0.04, gt=0.0, le=0.06)
    feel_speed_m_s: float = param("Speed of passes likely to touch something", unit="m/s", default=0.02, gt=0.0,
                                  le=0.06)  # fmt: skip
    travel_speed_m_s: float = param("Speed above all objects", unit="m/s", default=0.25, gt=0.0, le=0.25)
    clearance_m: float = param("Height of the passes above the known top", unit="m", default=0.0008, ge=0.0003, le=0.01)
    inset_m: float = param("Largest distance of the passes inside the outline", unit="m", default=0.010, ge=0.0,
                           le=0.03)  # fmt: skip
    reach_m: float = param("Largest distance of any place from the passes", unit="m", default=0.014, ge=0.003, le=0.05)
    headroom_m: float = param("Height of the ball above the floor when crossing an object", unit="m", default=0.15,
                              ge=0.02, le=0.2)  # fmt: skip


class TouchTop(Skill):
    """Measure a traced candidate's height: touch down in its middle, pass above it, touch whatever is higher.

    SUCCESS: `measured` is the candidate with the height of its highest touched place.
    """

    PAUSE = "retreat"
    Params = TouchTopParams
    params: TouchTopParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"probe", "fingers"})}
    USES: ClassVar = frozenset({"arm"})

    NO_TOP = Failure(
        "no_top",
        "nothing was met above the lowest point of the ball at its side contacts: the object was moved or is gone; "
        "`measured` is the candidate, at least that high",
        advice="trace it again: it was moved or is gone",
    )
    FAILURES: ClassVar = (
        *Prober.FAILURES,
        MOTION_REFUSED.with_meaning("the ball cannot be brought above the object; `measured` as for no_top"),
    )

    tool = In(HeldTool, "the held probe")
    candidate = In(Candidate, "the object, as traced")
    measured = Out(Candidate, "the same with its height", always=True)
    height_m = Out(float, "height of its top above the floor, m")
    gone = Out(bool, "nothing stands where it was traced", always=True)

    def run(self) -> SkillRun:
        """See the class."""
        candidate, tool = self.candidate, self.tool
        touched_m = float(np.median([c.tip_K_m[2] for c in candidate.contacts])) - tool.floor_z_K_m
        self.measured, self.gone = replace(candidate, height_m=max(candidate.height_m, touched_m)), False
        prober = Prober(self.context, tool, GuardParams())
        # A low object met the lower half of the ball.
        sides_m = touched_m - (tool.tip_radius_m if tool.round else 0.0)
        top = yield from drive(self._plan(candidate, sides_m), partial(self._make, prober))
        if top.ball_K_m is None:
            self.gone = True
            raise self.NO_TOP(
                f"nothing higher than {sides_m * 1e3:.0f} mm was met where candidate {candidate.index} was traced",
                sides_m=sides_m,
            )
        height = float(top.ball_K_m[2]) - tool.tip_radius_m - tool.floor_z_K_m
        self.measured, self.height_m = replace(candidate, height_m=height, top_touched=True), height
        self.event("candidate", candidate=self.measured)  # the final record of this candidate, with its height
        self.event("top", candidate=candidate.index, height_m=height, touches=top.touches, passed=top.passed)

    def _plan(self, candidate: Candidate, sides_m: float) -> TopPlan:
        p, tool = self.params, self.tool
        # Nearer to the outline than its radius, the ball would pass over free space.
        inset_m = min(max(INSET_SHARE * 0.5 * candidate.contour.size_m[1], tool.tip_radius_m), p.inset_m)
        reach_m = p.reach_m - (p.inset_m - inset_m)  # the middle stays as near to the passes
        rule = TopRule(clearance_m=p.clearance_m, inset_m=inset_m, reach_m=max(reach_m, MIN_REACH_M))
        points = np.array([c.point_K_m for c in candidate.contacts])
        floor = tool.floor_z_K_m
        return top_plan(
            candidate.contour.centre_K_m,
            rounds(points, candidate.contour.centre_K_m, rule),
            self._rim(candidate, points),
            floor + sides_m + tool.tip_radius_m,
            floor + p.headroom_m,
            rule,
        )

    def _rim(self, candidate: Candidate, points: Array) -> Array:
        every = max(len(points) // RIM_PLACES, 1)
        rim = points[::every][:RIM_PLACES]
        inwards = candidate.contour.centre_K_m - rim
        far = np.maximum(np.linalg.norm(inwards, axis=1, keepdims=True), 1e-9)
        return np.asarray(rim + RIM_INSET_M * inwards / far)

    def _make(self, prober: Prober, move: BallMove) -> Motion[BallOutcome]:
        p = self.params
        goal, tip = move.goal_K_m, prober.tip_K_m
        try:
            if move.kind == "over":
                yield from prober.hop(goal, float(goal[2]), p.travel_speed_m_s)
            elif move.kind in ("lift", "back"):
                way = goal - tip
                length = float(np.linalg.norm(way))
                if length > 1e-4:
                    yield from prober.retreat(way / length, length, min(p.travel_speed_m_s, FREE_M_S))
            else:
                speed = {"down": p.down_speed_m_s, "feel": p.feel_speed_m_s, "pass": p.pass_speed_m_s}[move.kind]
                probed = yield from prober.move(goal, speed, any_direction=move.kind != "down")
                if probed.contact is not None:
                    self.event("contact", contact=probed.contact)
                    return BallOutcome(prober.tip_K_m, probed.contact.tip_K_m)
        except MotionRefused as refusal:
            if move.kind not in ("pass", "feel"):
                raise
            self.event("note", text=f"a pass above candidate {self.candidate.index} was left out: {refusal}")
            return BallOutcome(prober.tip_K_m, refused=True)
        return BallOutcome(prober.tip_K_m)
