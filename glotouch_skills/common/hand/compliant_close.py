"""Closing the jaws on something that is not in their middle, and letting it go: the hand gives way, never presses hard.

A jaw's own push never reaches the robot's hard limit. A fingertip does that stands on a part of the object, a foot or a
step, while the jaws tilt the object or drag it along: it turns between fingertip and floor like a sprag, and the force
upwards grows with every tenth of a millimetre. So the jaw force rises by a ramp that what the hand feels can end, and
the jaws open as weakly as they close: what they drag stalls them, and the hand goes the way it is pushed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from glotouch_bt.motion import Arm, JawRestDetector, Motion
from glotouch_bt.robot import Array, GripperState, MotionRefused, Observation

GENTLE_N = 3.0
"""Jaw force until both jaws rest. Coupled jaws of which only one touches push with twice their force: 6 N slide the
heaviest object of CONDITIONS (3.1 N of friction) and harm none, where 20 N (squeeze) or 60 N (grasp) would tilt and
wedge what cannot slide."""
RAMP_N_S = 100.0
"""Rise of the jaw force after that, one newton a control period. At once, 10 N of jaw force were 20 N on the hand
within a period where a fingertip stood on a foot."""
YIELD_N = 3.0
"""Force along y_P at which the hand gives way: an object that slides on the floor resists with less."""
RELEASED_N = 1.0
"""Given way far enough; and a push from the other side of more than this means that both jaws touch."""
WEDGED_N, STOOD_N, STOOD_SHARE, GIVE_UP_N = 12.0, 10.0, 0.6, 20.0
"""Force on the hand at which a closure ends: the first while gentle jaws close, which cannot push with more than 6 N;
the second, or this share of a larger jaw force, while resting jaws press (on slopes as on walls 97 of 100 stay below
4 N at 10 N of jaw force); never more than the last, two thirds of the robot's own limit. What presses harder is wedged
or stands on a fingertip, and pressing would only lever it up."""
LEANING_N = 3.2
"""Change of the force on the hand at which gentle jaws that rest do not press: what both of them hold can only lean on
the hand with its friction on the floor (3.1 N for the heaviest object of CONDITIONS); what does more is wedged, and
the harder it is pressed the harder it snaps. All three closures that passed 30 N for a moment were above (simulated,
nominal; 3.3 N the least)."""
FREE_S = 0.05
"""So long the hand is felt before the jaws move."""
PACE = 0.75
"""Speed of giving way against the closing speed; half of it would only keep the jaw that touches where it is."""
MIN_STEP_M = 0.0005
TIMEOUT_S = 4.0
LETTING_GO_M_S, LETTING_GO_N, LET_GO_M, LETTING_GO_S = 0.02, 2.0, 0.003, 0.5
"""Opening begins slowly and weakly, until the jaws are so much farther apart; jaws that do not move are given so long:
what is held askew springs back, and what a fingertip stands on is dragged along with twice this force at most."""
OPENING_M_S, OPENING_N, OPENING_S = 0.2, 10.0, 3.5
"""Opening after that, and how long all of it may take."""
LOOSE_N, CAUGHT_N, FREED_N = 0.5, 4.0, 1.0
"""Jaws that hold with less than the first should not be felt: more than the second on the hand, and it is caught; less
than the third, and it is free again."""
FREEING_M, FREEING_M_S, MIN_TIP_M = 0.006, 0.02, 0.002
"""How far the hand goes the way it is pushed, how fast, and how near to the floor a fingertip may come."""

Watcher = Callable[[Observation], None]


def _no_one(seen: Observation) -> None:
    """Nobody watches."""


def close_gently(
    arm: Arm, speed_m_s: float, force_N: float, *, tactile: bool = False, seen_by: Watcher = _no_one
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
        MotionRefused: The hand was pressed with more than `WEDGED_N` while closing, `LEANING_N` when the gentle jaws
            rested, `STOOD_N` or `STOOD_SHARE` of the jaw force while pressing; the jaws have opened again.
    """
    closing = _Closing(arm, speed_m_s, tactile, seen_by)
    with arm.pause_signal.finishing():  # a pause comes when the jaws rest: until then the hand must be able to give way
        yield from closing.feel_free()
        state = yield from closing.until_rest([min(GENTLE_N, force_N)])
        if force_N > GENTLE_N:
            yield from closing.refuse_beyond(LEANING_N, closing.leaning_N)
            steps = int(np.ceil((force_N - GENTLE_N) / (RAMP_N_S * arm.period_s) - 1e-9))
            state = yield from closing.until_rest(np.linspace(GENTLE_N, force_N, steps + 1)[1:].tolist())
    return state


class _Closing:
    """One closure: what its stages share."""

    def __init__(self, arm: Arm, speed_m_s: float, tactile: bool, seen_by: Watcher) -> None:
        self._arm, self._speed_m_s, self._tactile, self._seen_by = arm, speed_m_s, tactile, seen_by
        self._opening_m, self._start_B = arm.aperture_m, arm.pose_B_P.position_m
        self._free_N = self._force_N = np.zeros(3)

    def feel_free(self) -> Motion[None]:
        """Take what is felt now as a free hand's force: the wrist need not be tared."""
        blocks = yield from self._arm.hold(FREE_S)
        self._free_N = np.mean([_force_P(b) for b in blocks], axis=0)

    @property
    def leaning_N(self) -> float:
        """How much the force on the hand differs from a free hand's now."""
        return float(np.linalg.norm(self._force_N - self._free_N))

    def refuse_beyond(self, max_N: float, pressed_N: float) -> Motion[None]:
        """Open again and refuse if the hand is pressed with more than this; a NaN is more."""
        if not pressed_N <= max_N:
            yield from let_go(self._arm, self._opening_m)
            raise MotionRefused("closing", f"the hand was pressed with {pressed_N:.0f} N while the jaws closed")

    def until_rest(self, forces_N: Sequence[float]) -> Motion[GripperState]:
        """Close under each force for one period, then under the last one until the jaws rest."""
        arm = self._arm
        watch = JawRestDetector(arm.period_s)
        for k in range(round(TIMEOUT_S / arm.period_s)):
            force_N = forces_N[min(k, len(forces_N) - 1)]
            seen = yield from self._one_period(force_N if k < len(forces_N) else None)
            self._force_N = _force_P(seen)
            yield from self.refuse_beyond(_max_N(force_N), float(np.linalg.norm(self._force_N)))
            if k >= len(forces_N) and watch.still(seen.now_s, seen.gripper):
                break
            yield from self._give_way(seen)
        return watch.state()

    def _one_period(self, force_N: float | None) -> Motion[Observation]:
        """Hold the arm one period, with a new limit of the jaw force if one is given."""
        arm, blocks = self._arm, list[Observation]()
        if force_N is None:
            blocks = yield from arm.hold(arm.period_s, tactile=self._tactile)
        else:
            yield from arm.jaws(
                0.0,
                speed_m_s=self._speed_m_s,
                force_N=force_N,
                timeout_s=arm.period_s,
                tactile=self._tactile,
                on_observation=blocks.append,
            )
        self._seen_by(blocks[-1])
        return blocks[-1]

    def _give_way(self, seen: Observation) -> Motion[None]:
        """Follow a jaw that pushes alone, if one does."""
        arm, force = self._arm, float(_force_P(seen)[1])
        if not (seen.gripper.moving and abs(force) > max(YIELD_N, seen.gripper.force_N)):
            return
        side = float(np.sign(force))
        y_B = np.asarray(arm.pose_B_P.rotation[:, 1])
        given = side * float((arm.pose_B_P.position_m - self._start_B) @ y_B)
        room = 0.5 * (self._opening_m - arm.aperture_m) - given
        if room > MIN_STEP_M:
            yield from arm.shift(
                side * room * y_B,
                PACE * self._speed_m_s,
                guard=_until_released(side, self._seen_by),
                check=False,
                tactile=self._tactile,
                what="give way",
            )


def _max_N(jaw_N: float) -> float:
    """Force on the hand at which a closure under this jaw force ends."""
    return WEDGED_N if jaw_N <= GENTLE_N else min(max(STOOD_N, STOOD_SHARE * jaw_N), GIVE_UP_N)


def let_go(arm: Arm, opening_m: float) -> Motion[None]:
    """Open the jaws to `opening_m`, slowly and weakly until they are off what they held.

    If the hand is pressed although the jaws hold nothing, a fingertip stands on something, or is caught under it or in
    a hollow of its flank: the jaws stop, the hand goes the way it is pushed until it is free, and they begin anew.
    What was held may drop onto a fingertip only after the jaws are off it, so this is watched until they are open. A
    pause waits until then.
    """
    with arm.pause_signal.finishing():
        yield from _let_go(arm, opening_m)


def _let_go(arm: Arm, opening_m: float) -> Motion[None]:
    held, given, weak, since = arm.aperture_m, 0.0, True, 0
    watch = JawRestDetector(arm.period_s)
    yield from _turn_jaws(arm, opening_m, weak)
    for k in range(round(OPENING_S / arm.period_s)):
        (seen,) = yield from arm.hold(arm.period_s)
        force = _force_P(seen)
        pressed = np.linalg.norm(force) > CAUGHT_N
        still = watch.still(seen.now_s, seen.gripper)
        if pressed and not (weak and seen.gripper.force_N >= LOOSE_N) and given < FREEING_M - MIN_STEP_M:
            yield from _turn_jaws(arm, arm.aperture_m, True)
            given += yield from _free(arm, force, FREEING_M - given)
            held, weak, since = arm.aperture_m, True, k
        elif weak and not pressed and arm.aperture_m > held + LET_GO_M:
            weak = False
        elif still and not (weak and k < since + round(LETTING_GO_S / arm.period_s)):
            break
        else:
            continue
        watch = JawRestDetector(arm.period_s)
        yield from _turn_jaws(arm, opening_m, weak)


def _turn_jaws(arm: Arm, aperture_m: float, weak: bool) -> Motion[None]:
    """Send the jaws elsewhere; one period."""
    speed_m_s, force_N = (LETTING_GO_M_S, LETTING_GO_N) if weak else (OPENING_M_S, OPENING_N)
    yield from arm.jaws(aperture_m, speed_m_s=speed_m_s, force_N=force_N, timeout_s=arm.period_s)


def _free(arm: Arm, force_P_N: Array, max_m: float) -> Motion[float]:
    """Go the way the hand is pushed (3,) until it is free, `max_m` at most; how far it went, at least a step."""
    container, tip_m = arm.world.container, arm.description.gripper.fingertip_below_P_m
    way_B = arm.pose_B_P.rotation @ (force_P_N / np.linalg.norm(force_P_N))
    down = -float(container.pose_B_K.rotation[:, 2] @ way_B)
    room = float(container.pose_B_K.inverse().apply(arm.pose_B_P.position_m)[2]) - tip_m - MIN_TIP_M
    length = max_m if down <= 0.0 else min(max_m, max(room, 0.0) / down)
    if length < MIN_STEP_M:
        return max_m
    moved = yield from arm.shift(
        length * way_B,
        FREEING_M_S,
        guard=lambda seen: "free" if np.linalg.norm(_force_P(seen)) < FREED_N else None,
        check=False,
        what="free the hand",
    )
    return max(moved.travelled_m, MIN_STEP_M)


def _until_released(side: float, seen_by: Watcher) -> Callable[[Observation], str | None]:
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
