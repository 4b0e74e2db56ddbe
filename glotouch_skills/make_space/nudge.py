"""Push an object along the floor with the fingers, and know afterwards where it stands."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from glotouch_bt.motion import FREE_M_S, Motion, hand_pose_B
from glotouch_bt.perception.touch import Candidate, TouchSet
from glotouch_bt.robot import HOLD, MotionRefused, Pose
from glotouch_bt.skill import MOTION_REFUSED, UNCHANGED, Failure, In, Out, Skill, SkillParams, SkillRun, param
from glotouch_skills.common.hand import glide, keeping_clear_of, rise_clear, unfelt_speed_steps
from glotouch_skills.common.planning import NEEDED_M, Push, PushPlanner, after_push, push_cost_m
from glotouch_skills.make_space.centring import CENTRED_SD_M, centred
from glotouch_skills.make_space.push_guard import STABLE, TOUCHING_N, Felt, PushGuard, push_guard, standing_force_B_N

MIN_FELT_N = 0.08
"""Least mean resistance of an object that slides with the fingers. The lightest of
conditions/realistic.yaml (40 g, friction 0.45) resists with 0.18 N; the mean over half a second has 0.01 N of noise."""
BUMP_N = 1.2
"""Force that ends the descent beside the object. The hand's inertial force is 0.6 N. Fingers on a low foot toppled an
object of 80 mm with 2.1 N."""
RETREAT_M = 0.006
"""Way back from the object before the hand rises, so that the fingers do not rub along it. Source: ours."""
EARLY_M = 0.005
"""An object that is met this much earlier or later than it was traced may stand elsewhere: the probe moved it, or it
has a low foot. Of 22 pushes of `bench space` (realistic), 21 met the object within 4 mm."""
NARROW_SHARE = 0.6
"""Opening for objects that are too narrow for `fork_m`, as a share of it. Source: ours."""
SHORT_M = 0.001
"""A push that was stopped this much before its end counts as complete: the hand is decelerating. Source: ours."""
HEAD = ("object", "direction, deg", "pushed, mm", "resistance, N", "peak, N", "end")
"""Head of the table in the report."""


def pushes_in_words(rows: tuple[tuple[str, ...], ...]) -> str:
    """Return the pushes so far in words, empty without any. Rows are as under `HEAD`; others are left out."""
    pushes = [dict(zip(HEAD, row, strict=True)) for row in rows if len(row) == len(HEAD)]
    return "; ".join(
        f"candidate {p['object']}: {p['pushed, mm']} mm at {p['direction, deg']} deg ({p['end']})" for p in pushes
    )


class NudgeParams(SkillParams):
    """Parameters of `nudge`.

    The arm yields little: at 20 mm/s a blocked object raises the force by 1.2 N in a control period, so the hand
    stops within a few newtons of `max_N`. The hard limit is 30 N.
    """

    distance_m: float = param(
        "Distance to push; 0: as far as the fingers need, in a direction that makes space for them",
        unit="m", default=0.0, ge=0.0, le=0.08,
    )  # fmt: skip
    direction_deg: float = param(
        "Direction of the push in the container, from x, if a distance is given", unit="deg", default=0.0, ge=-360.0,
        le=360.0,
    )  # fmt: skip
    from_long_side: bool = param("Count that direction from the outline's long side, not from x", default=False)
    speed_m_s: float = param("Speed of the push", unit="m/s", default=0.02, gt=0.0, le=0.03)
    max_N: float = param("Resistance that ends the push", unit="N", default=6.0, gt=0.0, le=10.0)
    height_m: float = param(
        "Height of the fingertips above the floor: low, so that the object slides and does not topple",
        unit="m", default=0.006, ge=0.003, le=0.02,
    )  # fmt: skip
    fork_m: float = param(
        "Opening of the jaws where there is room for it: two fingertips keep a round object between them",
        unit="m", default=0.03, ge=0.0, le=0.06,
    )  # fmt: skip
    centre: bool = param(
        "Close the jaws on the object once, across the push: it may have turned and moved aside", default=True
    )
    travel_speed_m_s: float = param("Speed above the objects", unit="m/s", default=0.25, gt=0.0, le=0.25)
    descent_speed_m_s: float = param(
        "Speed of the descent beside the object", unit="m/s", default=0.010, gt=0.0, le=0.04
    )


class Nudge(Skill):
    """Push one object along the floor: a stated way, or the shortest way that makes space for the fingers.

    The flat sides of the two fingers push through the object's centre, low and slowly: open, if there is room, so that
    a round object cannot slip sideways, else closed. The object slides with them from where they meet it to where they
    stop. Then the jaws close on it once, across the push, which centres it. Without that (`centre: false`, or no room),
    its position across the push becomes less certain. So do the positions of what it passed closely. A push that would
    topple it ends. The space is made for the first object of `cramped`; the pushed object may be a neighbour of it.
    With a stated distance, that object itself is pushed.

    SUCCESS: it was pushed all the way; `candidates` has its new position, and its touches are discarded.
    """

    Params = NudgeParams
    params: NudgeParams

    PRECONDITIONS: ClassVar = {"hand": frozenset({"empty", "fingers"}), "wrist": frozenset({"tared"})}
    POSTCONDITIONS: ClassVar = {"hand": "empty"}
    FAILURE_STATES: ClassVar = {"hand": frozenset({UNCHANGED, "empty"})}
    USES: ClassVar = frozenset({"arm"})

    NO_PUSH = Failure(
        "no_push",
        "no push can be made, or none makes more space for the fingers; nothing was moved",
        advice="push in another direction, or take a neighbour out by hand",
    )
    BLOCKED = Failure(
        "blocked",
        "the object stopped against something; `candidates` has its position there",
        advice="push in another direction",
    )
    TIPPING = Failure(
        "tipping",
        "the object was about to topple and was pushed no farther; `candidates` has its position there",
        advice="push in another direction, or lift it out with `clear_plan`, `grasp`, `lift` and `set_down`",
    )
    LEFT = Failure(
        "left",
        "the object left the fingers before they stopped: it rolled or toppled, and is not where it was traced",
        advice="trace it again",
    )
    NOTHING_PUSHED = Failure(
        "nothing_pushed",
        "nothing resisted the fingers all the way: the object is not where it was traced",
        advice="trace it again",
    )
    FAILURES: ClassVar = (MOTION_REFUSED.with_meaning("the hand cannot rise, or the fingers met something beside it"),)

    known = In(tuple, "all candidates", key="candidates", element=Candidate)
    cramped_before = In(tuple, "indices of candidates that lack space for the fingers", key="cramped", element=int)
    felt_before = In(tuple, "touches so far", key="touchsets", element=TouchSet, required=False, expected=False)
    refused_before = In(
        tuple, "closures that could not be made", key="refused", element=tuple, required=False, expected=False
    )
    doubtful_before = In(
        tuple, "indices of candidates that may have been moved", key="doubtful", element=int, required=False,
        expected=False,
    )  # fmt: skip
    before = In(tuple, "pushes so far, as in the report", key="nudges", element=tuple, required=False, expected=False)
    candidates = Out(tuple, "all candidates, the pushed one where it stands now", element=Candidate, always=True)
    cramped = Out(
        tuple, "none if the object was pushed or is not where it was traced: what lacks space now is not known",
        element=int,
    )  # fmt: skip
    touchsets = Out(tuple, "touches of objects that were not pushed", element=TouchSet, always=True)
    refused = Out(tuple, "closures that could not be made, of the other objects", always=True)
    doubtful = Out(tuple, "the same, with those that the object came close to", element=int, always=True)
    nudges = Out(tuple, "pushes so far, with this one", element=tuple, always=True, result=pushes_in_words)

    def run(self) -> SkillRun:
        """See the class."""
        self.candidates, self.touchsets = self.known, self.felt_before or ()
        self.refused, self.doubtful = self.refused_before or (), self.doubtful_before or ()
        self.nudges = self.before or ()
        target, push = yield from self._plan()
        (moving,) = (c for c in self.known if c.index == push.candidate)
        try:
            felt = yield from self._push(moving, push)
        except MotionRefused:
            self._doubt(moving.index)
            raise
        for place in (moving.contour.centre_K_m, moving.contour.centre_K_m + felt.pushed_m * push.along_K):
            self.context.arm.felt.forget_near(place)
        self.touchsets = tuple(t for t in self.touchsets if t.candidate.index != moving.index)
        self.refused = tuple(key for key in self.refused if key[0] not in (target.index, moving.index))
        if not felt.stopped and felt.resistance_N < MIN_FELT_N:
            self._doubt(moving.index)
            self.cramped = ()
            self._tell(push, felt, "nothing resisted")
            raise self.NOTHING_PUSHED(
                f"candidate {moving.index} was not met: {felt.resistance_N:.2f} N along {felt.pushed_m * 1e3:.0f} mm",
                resistance_N=felt.resistance_N,
            )
        if felt.left:
            self._doubt(moving.index)
            self.cramped = ()
            self._tell(push, felt, "left")
            raise self.LEFT(f"candidate {moving.index} was no longer felt before the end of the push")
        moved = yield from self._after(moving, push, felt)
        shift_m = float((moved.contour.centre_K_m - moving.contour.centre_K_m) @ push.along_K)
        self.candidates = tuple(moved if c.index == moved.index else c for c in self.known)
        self._doubt(*push.near)
        if abs(felt.early_m) > EARLY_M:
            self._doubt(moving.index)
        self.event("candidate", candidate=moved, moved_m=shift_m, ended="pushed")
        self._tell(push, felt, "tipping" if felt.tipping else "stopped" if felt.stopped else "pushed")
        if felt.stopped and felt.pushed_m > push.distance_m - SHORT_M:
            self.cramped = ()
            return
        if felt.tipping:
            raise self.TIPPING(
                f"candidate {moving.index} was about to topple after {felt.pushed_m * 1e3:.0f} mm of "
                f"{push.distance_m * 1e3:.0f}"
            )
        if felt.stopped:
            raise self.BLOCKED(
                f"candidate {moving.index} resisted with {felt.peak_N:.1f} N after {felt.pushed_m * 1e3:.0f} mm of "
                f"{push.distance_m * 1e3:.0f}",
                peak_N=felt.peak_N,
                limit_N=self.params.max_N,
            )
        self.cramped = ()

    def _plan(self) -> Motion[tuple[Candidate, Push]]:
        """Return the object that needs space and the push.

        Raises:
            SkillFailed: `no_push`.
        """
        p = self.params
        wanted = [c for index in self.cramped_before for c in self.known if c.index == index]
        yield HOLD
        if not wanted:
            raise self.NO_PUSH("no candidate is said to lack space")
        half_extent = 0.5 * np.array(self.context.world.container.interior_m[:2])
        gripper = self.context.arm.description.gripper
        openings = dict.fromkeys((p.fork_m, NARROW_SHARE * p.fork_m, 0.0))
        planners = [PushPlanner(self.known, half_extent, gripper, opening) for opening in openings]
        target = wanted[0]
        if p.distance_m > 0.0:
            side = target.contour.yaw_rad if p.from_long_side else 0.0
            stated = [a.along(target, side + float(np.deg2rad(p.direction_deg)), p.distance_m) for a in planners]
            for push in stated:
                if not isinstance(push, str):
                    return target, push
            raise self.NO_PUSH(f"candidate {target.index} cannot be pushed that way: {stated[-1]}")
        best: Push | None = None
        for planner in planners:
            found: Push | None = None
            for better in planner.for_space(target):
                found = better
                yield HOLD  # the computation takes longer than a control period; on hardware the arm holds meanwhile
            if found is not None and (best is None or push_cost_m(found) < push_cost_m(best)):
                best = found
            if best is not None and best.space_m >= NEEDED_M:
                break
        if best is None:
            raise self.NO_PUSH(
                f"no push makes space for the fingers over candidate {target.index}, or they have it already",
                advice="state a distance to push it all the same, or take a neighbour out by hand",
            )
        return target, best

    def _push(self, moving: Candidate, push: Push) -> Motion[Felt]:
        """Go behind the object, push it, and rise.

        Raises:
            MotionRefused: There is no way, or the fingers met something on the way down; the hand is high.
        """
        arm, p, container = self.context.arm, self.params, self.context.world.container
        tips = arm.description.gripper.fingertip_below_P_m
        low = hand_pose_B(arm, container, np.array([*push.start_K_m, p.height_m + tips]), push.yaw_K_rad)
        yield from rise_clear(arm)
        yield from arm.jaws(push.opening_m, speed_m_s=0.2)
        high = Pose(np.array([*low.position_m[:2], float(arm.pose_B_P.position_m[2])]), low.quat)
        others = [c for c in self.known if c.index != moving.index]
        top_m = max(c.height_m for c in self.known)
        with keeping_clear_of(arm, self.known):
            yield from arm.transit(high, height_B_m=float(high.position_m[2]), speed_m_s=p.travel_speed_m_s)
            free_B_N = yield from standing_force_B_N(arm)
            height = float(container.pose_B_K.inverse().apply(high.position_m)[2]) - tips
            speed_steps = unfelt_speed_steps(height, top_m, p.descent_speed_m_s)
            reached = yield from glide(self.context, low, FREE_M_S, speed_steps, BUMP_N)
        behind, ahead = moving.span_m(push.yaw_K_rad)
        may_topple = 0.5 * (ahead - behind) < STABLE * moving.height_m
        along_B = container.pose_B_K.rotation @ np.array([*push.along_K, 0.0])
        guard: PushGuard = yield from push_guard(arm, along_B, p.max_N, may_topple)
        if not reached or not np.linalg.norm(guard.free_B_N - free_B_N) <= TOUCHING_N:
            yield from rise_clear(arm)
            raise MotionRefused("nudge", "the fingers met something on the way down")
        with keeping_clear_of(arm, others), arm.pause_signal.finishing():
            way = push.approach_m + push.distance_m
            moved = yield from arm.shift(way * along_B, p.speed_m_s, guard=guard, what="push")
            felt = yield from guard.at_rest(push, moved.stop is not None)
            yield from arm.shift(-RETREAT_M * along_B, p.speed_m_s, check=False, what="retreat")
        yield from rise_clear(arm)
        return felt

    def _after(self, moving: Candidate, push: Push, felt: Felt) -> Motion[Candidate]:
        """Return the pushed object where it stands, which the jaws feel across the push."""
        early_m = 0.0 if np.isnan(felt.early_m) else felt.early_m
        if self.params.centre:
            moved = after_push(moving, push, felt.pushed_m, early_m, CENTRED_SD_M)
            with keeping_clear_of(self.context.arm, [c for c in self.known if c.index != moving.index]):
                standing, why_not = yield from centred(self.context, moved, push.yaw_K_rad)
            if standing is not None:
                return standing
            self.event("note", text=f"the jaws did not feel where candidate {moving.index} stands: {why_not}")
        return after_push(moving, push, felt.pushed_m, early_m)

    def _doubt(self, *indices: int) -> None:
        self.doubtful = tuple(sorted({*self.doubtful, *indices}))

    def _tell(self, push: Push, felt: Felt, end: str) -> None:
        """Record the push and add it to the report."""
        direction_deg = float(np.rad2deg(push.yaw_K_rad))
        self.event(
            "nudge",
            candidate=push.candidate,
            direction_deg=direction_deg,
            opening_m=push.opening_m,
            asked_m=push.distance_m,
            pushed_m=felt.pushed_m,
            resistance_N=felt.resistance_N,
            peak_N=felt.peak_N,
            stopped=felt.stopped,
            space_m=push.space_m,
            near=push.near,
            early_m=felt.early_m,
        )
        row = (
            f"{push.candidate}", f"{direction_deg:.0f}", f"{felt.pushed_m * 1e3:.0f}", f"{felt.resistance_N:.2f}",
            f"{felt.peak_N:.1f}", end,
        )  # fmt: skip
        self.nudges = (*self.nudges, row)
        self.report("Pushes", "Objects that the fingers pushed along the floor.", HEAD, self.nudges)
