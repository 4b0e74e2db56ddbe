"""Put the probe into its holder."""

from __future__ import annotations

import dataclasses

import numpy as np

from glotouch_bt.motion import FREE_M_S, Motion, MoveResult, SpeedSteps
from glotouch_bt.robot import Array, MotionRefused, Observation, Pose
from glotouch_bt.skill import Context, Failure, SkillRun
from glotouch_skills.common.hand import (
    CAUGHT_N,
    DOWN_B,
    REQUEST_FAILED,
    UP_B,
    Pressed,
    StraightGuard,
    Strayed,
    describe_stop,
    set_payload_and_tare,
    straight_guard,
)
from glotouch_skills.common.probe.plan_driver import HELD_TOLERANCE_M

OVER_HOLDER_M = 0.002
"""Within this distance of the holder's axis, the probe is in the holder or entering it (after a preemption)."""
SLOW_FROM_M = 0.02
"""Height above its place from which the probe is lowered slowly."""
ENTRY_M = 0.02
"""Height of the ball above the holder from which the probe is lowered at the speed of the insertion. Source: ours."""
SLOW_M_S = 0.01
"""Largest speed from there."""
CENTRED_M = 0.0015
"""Offset of the ball in the hand up to which it passes through the slot with the hand over the seat. Source: ours; the
simulated slot leaves 2.5 mm on each side."""
MAX_ASIDE_M = 0.004
"""Largest shift of the hand beside the seat while the ball passes through the slot: the shaft stays clear of its sides.
Source: ours; it has 4.5 mm on each side in the simulation."""
BELOW_M = 0.006
"""Clearance between the ball and the holder's lower edge from which the hand moves towards the seat. Source: ours; the
height of the rails, which the holder's description leaves out, and a margin."""
SEAT_M = 0.003
"""Height above its place from which the probe is lowered to its seat. Source: ours; a slip of 2 mm is found before."""
SEAT_M_S = 0.003
"""Largest speed from there: the arm moves on for two periods after the handle has met the holder. Source: ours; at
5 mm/s the hard limit stopped the arm when the handle met a stiff holder (simulation, contacts of 2.1 ms, seed 58414 of
`retrieve_generated` at 4a999d6d)."""
IN_PLACE_M = 0.001
"""Within this distance of its place, the probe may have been released already."""
MAX_INSERT_FORCE_N = 6.0
"""Change of force that ends the insertion: the probe slipped down in the jaws, or hangs tilted and meets the top of the
holder. The holder is stiff (37 N/mm in the simulation), and the arm moves on for two periods."""
RISE_M = 0.08
"""Height by which the empty hand rises from the stowed probe's handle."""

TOOL_LOST = Failure(
    "tool_lost",
    "the probe was dropped on its way into the holder; the hand is empty and above it",
    advice="the probe is in its holder or beside it; insert it by hand",
)
RETURN_PROBE_FAILURES = (TOOL_LOST, REQUEST_FAILED)


@dataclasses.dataclass(frozen=True)
class Dropped:
    """The move ended because the jaws no longer held the handle.

    Attributes:
        apart_m: Aperture then.
        with_it_m: Aperture with the handle between the jaws.
    """

    apart_m: float
    with_it_m: float

    def __str__(self) -> str:
        return f"the jaws were {self.apart_m * 1e3:.1f} mm apart, and {self.with_it_m * 1e3:.1f} mm with the probe"


@dataclasses.dataclass(frozen=True)
class Lowering:
    """Guard of the insertion: trip if the probe is no longer held, presses, or leaves its line.

    Attributes:
        straight: Guard of force and line.
        aperture_m: Aperture with the handle between the jaws.
    """

    straight: StraightGuard
    aperture_m: float

    def __call__(self, seen: Observation) -> Dropped | Pressed | Strayed | None:
        """See `motion.Guard`."""
        apart = seen.gripper.aperture_m
        if not abs(apart - self.aperture_m) <= HELD_TOLERANCE_M:
            return Dropped(apart, self.aperture_m)
        return self.straight(seen)


def return_probe(
    context: Context, yaw_B_rad: float, aperture_m: float, *, speed_m_s: float, insert_speed_m_s: float
) -> SkillRun:
    """Carry the probe over the holder, insert it, release it, rise, set the payload, tare.

    Args:
        context: The skill's.
        yaw_B_rad: Yaw of x_P in B at which the probe was grasped.
        aperture_m: Aperture with the handle between the jaws.
        speed_m_s: Speed with the probe in the hand.
        insert_speed_m_s: Speed into the holder.

    Raises:
        SkillFailed: `request_failed`, with the probe in its holder; `tool_lost`, if it was dropped on the way.
        MotionRefused: The holder cannot be reached, or the probe does not go in; the hand has risen with it.
        GuardTripped: The arm does not follow its setpoints; the probe is held.
    """
    arm, world = context.arm, context.world
    seat = world.holder.pose_B_grasp.position_m - arm.tool_seat.displacement_B_m
    grasp = Pose.pointing_down(seat, yaw_B_rad)
    above = dataclasses.replace(grasp, position_m=grasp.position_m + np.array([0.0, 0.0, world.probe.length_m + 0.06]))
    aside = _aside_m(arm.tool_seat.tip_B_m - arm.tool_seat.displacement_B_m)
    entry = dataclasses.replace(above, position_m=above.position_m + aside)
    here = arm.pose_B_P.position_m
    inside = any(np.linalg.norm(here[:2] - at.position_m[:2]) <= OVER_HOLDER_M for at in (above, entry))
    if here[2] > above.position_m[2] or not inside:
        height = max(float(here[2]), float(above.position_m[2]))
        yield from arm.transit(entry, height_B_m=height, speed_m_s=speed_m_s)
    through_m = world.probe.length_m - 2.0 * world.holder.half_m[2] - world.probe.tip_radius_m - BELOW_M
    stages = [(aside, through_m)] if aside.any() else []  # the ball through the slot, then the shaft over the seat
    for beside, high_m in (*stages, (np.zeros(3), SLOW_FROM_M)):
        near = dataclasses.replace(grasp, position_m=grasp.position_m + beside + np.array([0.0, 0.0, high_m]))
        if float(arm.pose_B_P.position_m[2]) > float(near.position_m[2]):
            outside = float(arm.pose_B_P.position_m[2] - grasp.position_m[2]) - world.probe.length_m - ENTRY_M
            speed_steps = ((0.0, max(FREE_M_S, insert_speed_m_s)), (max(outside, 0.0), insert_speed_m_s))
            moved = yield from _lower(context, near, speed_steps, aperture_m, MAX_INSERT_FORCE_N)
            if (why := describe_stop(moved)) is not None:
                yield from _rise(context, insert_speed_m_s)  # do not keep pressing on the holder
                raise MotionRefused("into the holder", why)
    left = float(np.linalg.norm(arm.pose_B_P.position_m - grasp.position_m))
    speed_steps = ((0.0, min(SLOW_M_S, insert_speed_m_s)), (left - SEAT_M, min(SEAT_M_S, insert_speed_m_s)))
    moved = yield from _lower(context, grasp, speed_steps, aperture_m, MAX_INSERT_FORCE_N)
    why = describe_stop(moved)
    if isinstance(moved.stop, Strayed):
        yield from _rise(context, insert_speed_m_s)
        raise MotionRefused("into the holder", str(why))
    yield from arm.jaws(min(aperture_m + 0.03, arm.description.gripper.stroke_m), speed_m_s=0.08)
    arm.scene.hold_tool(False)
    arm.tool_seat.released()
    yield from arm.shift(np.array([0.0, 0.0, RISE_M]), 0.08, check=False)
    yield from set_payload_and_tare(context)


def _aside_m(ball_B_m: Array) -> Array:
    """Return the shift (3,) of the hand that brings the ball over the middle of the slot; zero if it passes anyway.

    Args:
        ball_B_m: (3,) offset of the ball from the middle with the hand over its seat.
    """
    off = float(np.linalg.norm(ball_B_m))
    return np.zeros(3) if off < CENTRED_M else -ball_B_m * min(1.0, MAX_ASIDE_M / off)


def _lower(
    context: Context, goal: Pose, speed_steps: SpeedSteps, aperture_m: float, max_N: float
) -> Motion[MoveResult]:
    """Move straight to `goal`, until the force changes by more than `max_N`; `speed_steps` begin at 0.

    Raises:
        SkillFailed: `tool_lost`; the hand has risen again.
    """
    arm = context.arm
    way = goal.position_m - arm.pose_B_P.position_m
    straight = yield from straight_guard(arm, way if way.any() else DOWN_B, max_N)
    released = not arm.scene.holding_tool or np.linalg.norm(goal.position_m - arm.pose_B_P.position_m) < IN_PLACE_M
    guard = straight if released else Lowering(straight, aperture_m)  # released before a preemption
    moved = yield from arm.line(goal, speed_steps[0][1], check=False, speed_steps=speed_steps, guard=guard)
    if not isinstance(moved.stop, Dropped):
        return moved
    arm.scene.hold_tool(False)
    arm.tool_seat.released()
    arm.felt.forget()
    yield from _rise(context, speed_steps[-1][1])
    raise TOOL_LOST(
        f"the probe was dropped on its way into the holder: {moved.stop}",
        aperture_m=moved.stop.apart_m,
        taken_m=aperture_m,
    )


def _rise(context: Context, speed_m_s: float) -> SkillRun:
    """Move straight up, off the obstacle."""
    guard = yield from straight_guard(context.arm, UP_B, CAUGHT_N)
    yield from context.arm.shift(RISE_M * UP_B, speed_m_s, check=False, guard=guard)
