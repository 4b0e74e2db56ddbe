"""Putting the probe into its holder: shared by `tool_return` and `stow`."""

from __future__ import annotations

import dataclasses

import numpy as np

from glotouch_bt.motion import Motion, MoveResult
from glotouch_bt.robot import MotionRefused, Observation, Pose, SetPayload, Tare
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
    finish,
    straight_guard,
)
from glotouch_skills.common.probe.plan_driver import HELD_TOLERANCE_M

OVER_HOLDER_M = 0.002
"""This near to the holder's axis the probe is in it, or on its way in (the skill was broken off there)."""
NEAR_M, LAST_M_S = 0.02, 0.01
"""From so far above its place it is lowered slowly, by the second."""
THERE_M = 0.001
"""So near to its place it may have been let go of already."""
STANDS_N = 6.0
"""Change of force at which it stands before its time: it slipped down in the jaws, or hangs askew and meets the top of
the holder, which gives nothing: 37 N/mm in the simulation, and the arm goes on for two periods."""
OVER_STOWED_M = 0.08
"""The empty hand rises so far from the stowed probe's handle."""

TOOL_LOST = Failure(
    "tool_lost",
    "the probe was dropped on its way into the holder; the hand is empty and above it",
    advice="it stands in its holder or lies beside it; put it there by hand",
)
RETURN_PROBE_FAILURES = (TOOL_LOST, REQUEST_FAILED)


@dataclasses.dataclass(frozen=True)
class Dropped:
    """The move ended because the jaws were not on the handle any more.

    Attributes:
        apart_m: Their opening; with_it_m: that with the handle between them.
    """

    apart_m: float
    with_it_m: float

    def __str__(self) -> str:
        return f"the jaws were {self.apart_m * 1e3:.1f} mm apart, and {self.with_it_m * 1e3:.1f} mm with the probe"


@dataclasses.dataclass(frozen=True)
class Lowering:
    """A guard of the probe's way into its holder: it is held all the way, and neither presses nor outliers.

    Attributes:
        straight: What it may press and how far it may stray.
        aperture_m: Opening of the jaws with the handle between them.
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
    """Over the holder, in until it stands, open the jaws, rise, tell the controller, tare.

    Args:
        context: The skill's.
        yaw_B_rad: Yaw of x_P in B at which the probe was grasped.
        aperture_m: Opening of the jaws with the handle between them.
        speed_m_s, insert_speed_m_s: With the probe in the hand; into the holder.

    Raises:
        SkillFailed: `request_failed`; the probe stands in its holder. `tool_lost`; it was dropped on the way.
        MotionRefused: The holder cannot be reached, or the probe does not go in: the hand has risen with it again.
        GuardTripped: The arm does not follow its setpoints; the probe is held.
    """
    arm, world = context.arm, context.world
    grasp = Pose.pointing_down(world.holder.pose_B_grasp.position_m, yaw_B_rad)
    above = dataclasses.replace(grasp, position_m=grasp.position_m + np.array([0.0, 0.0, world.probe.length_m + 0.06]))
    here = arm.pose_B_P.position_m
    if here[2] > above.position_m[2] or np.linalg.norm(here[:2] - above.position_m[:2]) > OVER_HOLDER_M:
        height = max(float(here[2]), float(above.position_m[2]))
        yield from arm.transit(above, height_B_m=height, speed_m_s=speed_m_s)
    near = dataclasses.replace(grasp, position_m=grasp.position_m + np.array([0.0, 0.0, NEAR_M]))
    if float(arm.pose_B_P.position_m[2]) > float(near.position_m[2]):
        moved = yield from _lower(context, near, insert_speed_m_s, aperture_m, STANDS_N)
        if (why := describe_stop(moved)) is not None:
            yield from _rise(context, insert_speed_m_s)  # what is pressed on is not left pressed on
            raise MotionRefused("into the holder", why)
    moved = yield from _lower(context, grasp, min(LAST_M_S, insert_speed_m_s), aperture_m, STANDS_N)
    why = describe_stop(moved)
    if isinstance(moved.stop, Strayed):
        yield from _rise(context, insert_speed_m_s)
        raise MotionRefused("into the holder", str(why))
    yield from arm.jaws(min(aperture_m + 0.03, arm.description.gripper.stroke_m), speed_m_s=0.08)
    arm.scene.hold_tool(False)
    yield from arm.shift(np.array([0.0, 0.0, OVER_STOWED_M]), 0.08, check=False)
    yield from nothing_in_hand(context)


def _lower(context: Context, goal: Pose, speed_m_s: float, aperture_m: float, max_N: float) -> Motion[MoveResult]:
    """Down to `goal`, until something presses with more than `max_N`.

    Raises:
        SkillFailed: `tool_lost`; the hand has risen again.
    """
    arm = context.arm
    straight = yield from straight_guard(arm, DOWN_B, max_N)
    released = not arm.scene.holding_tool or np.linalg.norm(goal.position_m - arm.pose_B_P.position_m) < THERE_M
    guard = straight if released else Lowering(straight, aperture_m)  # let go of, where the skill was broken off
    moved = yield from arm.line(goal, speed_m_s, check=False, guard=guard)
    if not isinstance(moved.stop, Dropped):
        return moved
    arm.scene.hold_tool(False)
    yield from _rise(context, speed_m_s)
    raise TOOL_LOST(
        f"the probe was dropped on its way into the holder: {moved.stop}",
        aperture_m=moved.stop.apart_m,
        taken_m=aperture_m,
    )


def _rise(context: Context, speed_m_s: float) -> SkillRun:
    """Straight up, off what was met."""
    guard = yield from straight_guard(context.arm, UP_B, CAUGHT_N)
    yield from context.arm.shift(OVER_STOWED_M * UP_B, speed_m_s, check=False, guard=guard)


def nothing_in_hand(context: Context) -> SkillRun:
    """Tell the controller that the hand is empty, and zero the wrist.

    Raises:
        SkillFailed: `request_failed`.
    """
    yield from finish(context.requests.start(SetPayload(0.0, np.zeros(3))), "payload")
    yield from context.arm.hold(0.2)
    yield from finish(context.requests.start(Tare()), "tare")
