"""Carry the object in the hand to a free place, set it down, and know where it stands."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from glotouch_bt.motion import Motion
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import Array, MotionRefused, Pose
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import (
    CLEARANCE_M,
    MIN_GRIP_M,
    RELEASE_HEIGHT_M,
    glide,
    keeping_clear_of,
    let_jaws_rest,
    lower,
    release,
    require_clear,
    rise_clear,
)
from glotouch_skills.common.planning import FreePlace, GraspPlan, Neighbour, gap_m
from glotouch_skills.make_space.carried import Grip, after_carry, centred_m

OPEN_BY_M = 0.02
"""Least opening of the jaws for the release, beyond the held width: 10 mm on each side, as at a closure."""
MAX_FOLLOWED_M = 0.05
"""A hand that is farther than this from the planned grasp has moved since it lifted the object. The closing jaws follow
an object by half of their opening (43 mm) at most."""
PRESS_N = 5.0
"""Force that an object touching the floor too early is pressed down with: one that hangs askew turns upright between
the pads. The hard limit is 30 N."""
PRESS_SPEED_RATIO = 0.5
"""Speed of pressing over that of setting down: the arm is stiff."""
ASKEW_M = 0.004
"""An object that is released higher than this above its place hung askew and may have fallen. Source: ours."""
NEAR_M = 0.006
"""Objects nearer than this to the carried one, before or after, may have been moved: it slides as the jaws close, and
the outlines have errors. Source: ours."""
HEAD = ("object", "from, mm", "to, mm", "turned, deg", "set down above its place, mm", "end")
"""Head of the table in the report."""


class SetDownParams(SkillParams):
    """Parameters of `set_down`."""

    speed_m_s: float = param("Speed high above the objects", unit="m/s", default=0.10, gt=0.0, le=0.25)
    approach_speed_m_s: float = param(
        "Speed of the descent to just above the place", unit="m/s", default=0.02, gt=0.0, le=0.10
    )
    lower_speed_m_s: float = param("Speed of setting down", unit="m/s", default=0.008, gt=0.0, le=0.04)
    drop_m: float = param(
        "Largest height above the place at which it may be released", unit="m", default=0.015, ge=0.0, le=0.05
    )
    press_m: float = param(
        "Largest height above the place from which an object that touches is pressed down, to stand upright", unit="m",
        default=0.025, ge=0.0, le=0.05,
    )  # fmt: skip
    min_aperture_m: float = param("Minimum aperture of jaws that hold something", unit="m", default=MIN_GRIP_M, ge=0.0)


class SetDown(Skill):
    """Carry the held object to the first of the given places that the arm reaches, lower it, and open gently.

    The hand must still be above where it took the object. The jaws have centred the object between them, and it moves
    with the hand. So its outline, moved and turned, is known afterwards.

    SUCCESS: the jaws are open and high; `candidates` has the object where it stands now, and its touches are discarded.
    """

    Params = SetDownParams
    params: SetDownParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"object"})}
    POSTCONDITIONS: ClassVar = {"hand": "empty"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "empty"})}
    USES: ClassVar = frozenset({"arm"})

    NOT_HELD = Failure(
        "not_held",
        "the jaws hold nothing: the object fell; it is not where it was traced",
        advice="trace it again",
    )
    NO_PLACE = Failure(
        "no_place",
        "the arm reaches none of the places with the object; it is still held, and high",
        advice="put it back with `put_back`, and take out another object",
    )
    IN_THE_WAY = Failure(
        "in_the_way",
        "the object met something high above the place; it is still held, and high",
        advice="put it back with `put_back`; something stands at the place that the probe did not find",
    )
    FAILURES: ClassVar = (
        MOTION_REFUSED.with_meaning("the place cannot be reached, with the object still held, or the jaws were caught"),
    )

    made = In(GraspPlan, "how it was taken")
    places = In(tuple, "where to set it down, preferred first", element=FreePlace)
    known = In(tuple, "all candidates", key="candidates", element=Candidate)
    felt_before = In(tuple, "touches so far", key="touchsets", element=TouchSet, required=False, expected=False)
    doubtful_before = In(
        tuple, "indices of candidates that may have been moved", key="doubtful", element=int, required=False,
        expected=False,
    )  # fmt: skip
    before = In(
        tuple, "objects set down so far, as in the report", key="cleared", element=tuple, required=False, expected=False
    )
    candidates = Out(tuple, "all candidates, the carried one where it stands now", element=Candidate, always=True)
    cramped = Out(tuple, "none: what lacks space now is not known yet", element=int)
    touchsets = Out(tuple, "touches of objects that were not carried", element=TouchSet, always=True)
    refused = Out(tuple, "none: what stood in the way of a closure may be gone", element=tuple)
    doubtful = Out(tuple, "the same, with those that the object came close to", element=int, always=True)
    cleared = Out(tuple, "objects set down so far, with this one", element=tuple, always=True)

    def run(self) -> SkillRun:
        """See the class."""
        self.candidates, self.touchsets = self.known, self.felt_before or ()
        self.doubtful = self.doubtful_before or ()
        self.cleared = self.before or ()
        arm, p = self.context.arm, self.params
        yield from rise_clear(arm, p.speed_m_s)
        yield from let_jaws_rest(arm)
        index = self.made.candidate
        (moving,) = (c for c in self.known if c.index == index)
        if arm.aperture_m < p.min_aperture_m:
            self._doubt(index)
            raise self.NOT_HELD(
                f"candidate {index} fell: the jaws are {arm.aperture_m * 1e3:.1f} mm apart", aperture_m=arm.aperture_m
            )
        taken = self._taken()
        others = [c for c in self.known if c.index != index]
        with keeping_clear_of(arm, others):
            place, low, opening = self._first_in_reach(moving, taken)
            over = Pose(np.array([*low.position_m[:2], float(arm.pose_B_P.position_m[2])]), low.quat)
            yield from arm.transit(over, float(over.position_m[2]), p.speed_m_s, what="carry")
            reached, above_m = yield from lower(self.context, low, p.approach_speed_m_s, p.lower_speed_m_s)
            if not reached and above_m <= p.press_m:
                yield from glide(self.context, low, PRESS_SPEED_RATIO * p.lower_speed_m_s, bump_N=PRESS_N)
                above_m = float(arm.pose_B_P.position_m[2] - low.position_m[2])
        if not reached and above_m > p.drop_m:
            yield from rise_clear(arm, p.speed_m_s)
            raise self.IN_THE_WAY(
                f"candidate {index} met something {above_m * 1e3:.0f} mm above its place and is still held",
                above_m=above_m,
                limit_m=p.drop_m,
            )
        released = self._grip()
        yield from self._open(opening)
        self._note(moving, place, taken, released, above_m)

    def _open(self, opening_m: float) -> Motion[None]:
        yield from release(self.context.arm, opening_m)
        yield from rise_clear(self.context.arm, self.params.speed_m_s)

    def _grip(self) -> Grip:
        """Return the hand as it is now."""
        container, pose = self.context.world.container, self.context.arm.pose_B_P
        position_K = container.pose_B_K.inverse().apply(pose.position_m)
        return Grip(position_K[:2], pose.yaw_rad - container.pose_B_K.yaw_rad)

    def _taken(self) -> Grip:
        """Return the hand as it closed: it was lifted straight up since."""
        now, planned = self._grip(), self.made.position_K_m[:2]
        if float(np.linalg.norm(now.position_K_m - planned)) <= MAX_FOLLOWED_M:
            return now
        return replace(now, position_K_m=planned)

    def _first_in_reach(self, moving: Candidate, taken: Grip) -> tuple[FreePlace, Pose, float]:
        """Return the first place that the open hand reaches, its pose there, and the opening of the release.

        Raises:
            SkillFailed: `no_place`.
        """
        arm, container = self.context.arm, self.context.world.container
        stroke_m = arm.description.gripper.stroke_m
        narrow = min(max(arm.aperture_m, 0.0) + OPEN_BY_M, stroke_m)
        wide = min(max(self.made.opening_m, narrow), stroke_m)
        centring = centred_m(moving, taken, self._pad_half_m)
        refusals = []
        for place in self.places:
            at = place.moved(taken.position_K_m - centring)
            height_m = float(self.made.position_K_m[2]) + RELEASE_HEIGHT_M
            position_B = container.pose_B_K.apply(np.array([*at, height_m]))
            low = Pose.pointing_down(position_B, arm.pose_B_P.yaw_rad + place.turn_rad)
            for opening in (wide, narrow):
                try:
                    require_clear(arm, low, opening, CLEARANCE_M)
                except MotionRefused as refusal:
                    refusals.append(str(refusal))
                    continue
                return place, low, opening
        raise self.NO_PLACE(
            f"none of {len(self.places)} places can be reached; the last: {refusals[-1] if refusals else 'none given'}",
            places=len(self.places),
        )

    @property
    def _pad_half_m(self) -> float:
        return 0.5 * self.context.arm.description.gripper.pad_window_m[0]

    def _note(self, moving: Candidate, place: FreePlace, taken: Grip, released: Grip, above_m: float) -> None:
        """Enter the object where it stands now, doubt what it may have moved, and report it."""
        moved = after_carry(moving, taken, released, self._pad_half_m)
        self.candidates = tuple(moved if c.index == moving.index else c for c in self.known)
        for stood in (moving, moved):
            self.context.arm.felt.forget_near(stood.contour.centre_K_m)
        self.touchsets = tuple(t for t in self.touchsets if t.candidate.index != moving.index)
        self.refused = ()
        stands = [Neighbour.of(moving), Neighbour.of(moved)]
        others = [Neighbour.of(c) for c in self.known if c.index != moving.index]
        self._doubt(*(n.index for n in others if min(gap_m(s, n) for s in stands) < NEAR_M))
        if above_m > ASKEW_M:
            self._doubt(moving.index)
        self.cramped = ()
        start, end = moving.contour.centre_K_m, moved.contour.centre_K_m
        turn_deg = float(np.rad2deg(place.turn_rad))
        self.event("candidate", candidate=moved, moved_m=float(np.linalg.norm(end - start)), ended="set down")
        self.event("set_down", candidate=moving.index, from_K_m=start, to_K_m=end, turn_deg=turn_deg, above_m=above_m)
        row = (f"{moving.index}", _mm(start), _mm(end), f"{turn_deg:.0f}", f"{above_m * 1e3:.1f}", "set down")
        self.cleared = (*self.cleared, row)
        self.report(
            "Objects set down", "Objects that were lifted out to make space for the fingers.", HEAD, self.cleared
        )

    def _doubt(self, *indices: int) -> None:
        self.doubtful = tuple(sorted({*self.doubtful, *indices}))


def _mm(point_K_m: Array) -> str:
    return f"{point_K_m[0] * 1e3:.0f}, {point_K_m[1] * 1e3:.0f}"
