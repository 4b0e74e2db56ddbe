"""Closing the jaws on something that is not in their middle: the hand gives way to it and never presses hard."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glotouch_bt.motion import Arm, Motion
from glotouch_bt.motion.jaws import JawWatch
from glotouch_bt.robot import Array, GripperState, MotionRefused, Observation

GENTLE_N = 3.0
"""Jaw force until both jaws rest. Coupled jaws of which only one touches push with twice their force: 6 N slide the
heaviest object of CONDITIONS (3.1 N of friction) and harm none, where 20 N (squeeze) or 60 N (grasp) would tilt and
wedge what cannot slide."""
YIELD_N = 3.0
"""Force along y_P at which the hand gives way: an object that slides on the floor resists with less."""
RELEASED_N = 1.0
"""Given way far enough; and a push from the other side of more than this means that both jaws touch."""
GIVE_UP_N, WEDGED_N = 20.0, 12.0
"""Force on the hand at which a closure ends. Source: two thirds of the robot's own limit; it rises by 0.1 N/ms. While
the jaws close gently they cannot push with more than 6 N: what presses harder then is wedged between them or stands on
a fingertip, and pressing would only lever it up."""
PACE = 0.75
"""Speed of giving way against the closing speed; half of it would only keep the jaw that touches where it is."""
LEAST_STEP_M = 0.0005
TIMEOUT_S = 4.0
LETTING_GO_M_S, LET_GO_M, LETTING_GO_S, OPENING_M_S = 0.04, 0.003, 0.3, 0.2
"""Opening begins slowly until the jaws are so much farther apart, or so long: what is held askew springs back."""


def _no_one(seen: Observation) -> None:
    """Nobody watches."""


def close_gently(
    arm: Arm,
    speed_m_s: float,
    force_N: float,
    *,
    tactile: bool = False,
    seen_by: Callable[[Observation], None] = _no_one,
) -> Motion[GripperState]:
    """Close with little force until the jaws rest, then press; while only one jaw touches, the hand moves its way.

    What stands high or is held below cannot slide between the jaws as it does near the floor: a jaw that met it first
    would tilt it and press ever harder. So the hand follows the force along y_P, never farther than the jaws have
    closed: the fingers stay within the room they had when open. The jaws are coupled: one that pushes alone passes
    twice the reported jaw force on to the hand; where less arrives, both of them touch.

    Args:
        arm: At rest, jaws open; its hand points down.
        speed_m_s: Rate of the aperture.
        force_N: Largest force of one jaw.
        tactile: Ask for depth maps on the way.
        seen_by: Called with every observation on the way.

    Returns:
        The last report of the jaws.

    Raises:
        MotionRefused: The hand was pressed with more than `WEDGED_N` while closing, `GIVE_UP_N` while pressing; the
            jaws have opened again.
    """
    opening = arm.aperture_m
    start_B = arm.pose_B_P.position_m
    state: GripperState | None = None
    for force, give_up in ((GENTLE_N, WEDGED_N), (force_N, GIVE_UP_N)):
        if force <= force_N:
            state = yield from _close(arm, speed_m_s, force, give_up, opening, start_B, tactile, seen_by)
    assert state is not None
    return state


def _close(
    arm: Arm,
    speed_m_s: float,
    force_N: float,
    give_up_N: float,
    opening_m: float,
    start_B: Array,
    tactile: bool,
    seen_by: Callable[[Observation], None],
) -> Motion[GripperState]:
    """One stage: until the jaws rest under `force_N`."""
    yield from arm.jaws(
        0.0, speed_m_s=speed_m_s, force_N=force_N, timeout_s=arm.period_s, tactile=tactile, on_observation=seen_by
    )
    watch = JawWatch(arm.period_s)
    for _ in range(round(TIMEOUT_S / arm.period_s)):
        (seen,) = yield from arm.hold(arm.period_s, tactile=tactile)
        seen_by(seen)
        force = _force_P(seen)
        if not np.linalg.norm(force) <= give_up_N:
            yield from let_go(arm, opening_m)
            raise MotionRefused(
                "closing", f"the hand was pressed with {np.linalg.norm(force):.0f} N while the jaws closed"
            )
        if watch.still(seen.now_s, seen.gripper):
            break
        if seen.gripper.moving and abs(force[1]) > max(YIELD_N, seen.gripper.force_N):
            side = float(np.sign(force[1]))
            y_B = np.asarray(arm.pose_B_P.rotation[:, 1])
            given = side * float((arm.pose_B_P.position_m - start_B) @ y_B)
            room = 0.5 * (opening_m - arm.aperture_m) - given
            if room > LEAST_STEP_M:
                yield from arm.shift(
                    side * room * y_B,
                    PACE * speed_m_s,
                    guard=_until_released(side, seen_by),
                    check=False,
                    tactile=tactile,
                    what="give way",
                )
    return watch.state()


def let_go(arm: Arm, opening_m: float) -> Motion[None]:
    """Open the jaws to `opening_m`, slowly until they are off what they held."""
    held = arm.aperture_m
    yield from arm.jaws(opening_m, speed_m_s=LETTING_GO_M_S, timeout_s=arm.period_s)
    for _ in range(round(LETTING_GO_S / arm.period_s)):
        if arm.aperture_m > held + LET_GO_M:
            break
        yield from arm.hold(arm.period_s)
    yield from arm.jaws(opening_m, speed_m_s=OPENING_M_S)


def _until_released(side: float, seen_by: Callable[[Observation], None]) -> Callable[[Observation], str | None]:
    def guard(seen: Observation) -> str | None:
        seen_by(seen)
        force = _force_P(seen)
        if not np.linalg.norm(force) <= GIVE_UP_N:
            return "pressed"
        both = seen.gripper.force_N > max(YIELD_N, side * force[1])
        return "released" if both or side * force[1] < RELEASED_N else None

    return guard


def _force_P(seen: Observation) -> Array:
    """Mean tared force (3,) of one period in P's axes, which are the sensor's."""
    return np.asarray(seen.wrench_S[:, :3].mean(axis=0))
