"""Close the jaws on an object that is not centred between them, and release it, without pressing the hand hard.

The push of a jaw alone never reaches the robot's hard limit. A fingertip standing on a part of the object (a foot, a
step) can: while the jaws tilt or drag the object, it wedges between fingertip and floor, and the upward force grows
with every tenth of a millimetre. So the jaw force rises along a ramp that the measured force can stop, and the jaws
open as weakly as they close: an object they drag stalls them, and the hand moves the way it is pushed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from glotouch_bt.motion import Arm, JawRestDetector, Motion
from glotouch_bt.perception.touch import pad_noise_m, patch_statistics
from glotouch_bt.robot import Array, GripperState, MotionRefused, Observation, TactileFrame
from glotouch_skills.common.hand.descent import note_open_fingers

GENTLE_FORCE_N = 3.0
"""Jaw force until both jaws rest. Coupled jaws of which only one touches push with twice this force. 6 N slide the
heaviest object of conditions/nominal.yaml (3.1 N of friction); 20 N (squeeze) or 60 N (grasp) would tilt and wedge an
object that cannot slide."""
RAMP_N_S = 100.0
"""Rise of the jaw force once the jaws rest: one newton a control period. Applied at once, 10 N of jaw force became 20
N on the hand within a period where a fingertip stood on a foot."""
FOLLOW_FORCE_N = 3.0
"""Follow a force along y_P above this; an object that slides on the floor resists with less."""
RELEASED_FORCE_N = 1.0
"""Stop following below this. A push of more than this from the other side means that both jaws touch."""
MAX_CLOSING_FORCE_N = 12.0
"""End a gentle closure at this force on the hand; gentle jaws push with 6 N at most, so more means a wedged object."""
MIN_PRESSING_LIMIT_N = 10.0
"""Minimum force on the hand that ends a closure while resting jaws press. At 10 N of jaw force, 97 of 100 closures stay
below 4 N, on slopes as on walls."""
PRESSING_LIMIT_SHARE = 0.6
"""The same limit as a share of the jaw force, where that is larger."""
MAX_HAND_FORCE_N = 20.0
"""Never press the hand harder than this: two thirds of the robot's own limit."""
MAX_REST_FORCE_N = 3.2
"""Refuse to press above this change of the force on the hand once gentle jaws rest. A free object transmits at most its
floor friction (3.1 N for the heaviest of conditions/nominal.yaml); a larger force means it is wedged, and pressing
harder makes it snap. All three closures that passed 30 N were above this limit, the least with 3.3 N. Source:
simulation, nominal."""
MAX_TWIST_NM = 0.25
"""Largest torque about z_P with which the jaws turn an object that the two gels touch at different places along x_P.
30 N at contacts 8 mm apart reach it. A box of 50 mm by 40 mm was held by opposite corners, 17 mm apart. It
turned at once when the jaw force had reached 29 N, and the true force on the hand peaked at 40 N. Source: simulation,
`test_what_frozen_gels_did_not_feel_is_touched_again` at a269b288; the bound is ours."""
MIN_TWISTING_N = 10.0
"""Jaw force that needs no such bound: squeezes use it on every object. Source: default of `ClosureParams.force_N`."""
BASELINE_S = 0.05
"""Time for which the force on the free hand is averaged before the jaws move."""
FOLLOW_SPEED_RATIO = 0.75
"""Speed of following over the closing speed; 0.5 would only keep the touching jaw in place."""
MIN_STEP_M = 0.0005
"""Do not make moves shorter than this."""
TIMEOUT_S = 4.0
"""Longest wait for the jaws to rest."""
RELEASE_SPEED_M_S = 0.02
"""Opening speed until the jaws have moved apart by `RELEASED_BY_M`: an object held askew springs back."""
RELEASE_FORCE_N = 2.0
"""Jaw force meanwhile: an object that a fingertip stands on is dragged with at most twice this force."""
RELEASED_BY_M = 0.003
"""The object is released once the jaws are this much farther apart."""
RELEASE_STALL_S = 0.5
"""Longest wait for jaws that do not move while they open weakly."""
OPEN_SPEED_M_S = 0.2
"""Opening speed after the release."""
OPEN_FORCE_N = 10.0
"""Jaw force after the release."""
OPEN_TIMEOUT_S = 3.5
"""Longest duration of the whole opening."""
LOOSE_JAW_FORCE_N = 0.5
"""Jaws that hold with less than this should not be felt on the hand."""
CAUGHT_FORCE_N = 4.0
"""The hand is caught if loose jaws leave more than this on it."""
FREED_FORCE_N = 1.0
"""A caught hand is free again below this."""
MAX_FREEING_M = 0.006
"""Longest way on which a caught hand follows the force."""
FREEING_SPEED_M_S = 0.02
"""Speed on that way."""
MIN_TIP_HEIGHT_M = 0.002
"""Least height of the fingertips above the floor on that way."""

Observer = Callable[[Observation], None]


def _ignore(seen: Observation) -> None:
    """Ignore it."""


def close_compliantly(
    arm: Arm, speed_m_s: float, force_N: float, *, tactile: bool = False, on_observation: Observer = _ignore
) -> Motion[GripperState]:
    """Close with little force until the jaws rest, then press; while only one jaw touches, follow its push.

    A tall object, or one held from below, cannot slide between the jaws as it does near the floor: the jaw that touches
    it first would tilt it and press ever harder. So the hand follows the force along y_P, at most by what the jaws have
    closed: the fingers stay inside the space they took when open. The jaws are coupled: one that pushes alone passes
    twice the reported jaw force on to the hand. Less than that means that both touch.

    Args:
        arm: At rest, jaws open, hand pointing down.
        speed_m_s: Rate of the aperture.
        force_N: Largest force of one jaw. It is lowered where it would turn the object with more than `MAX_TWIST_NM`.
        tactile: Request depth maps.
        on_observation: Called with every observation.

    Returns:
        The last jaw state.

    Raises:
        MotionRefused: The force on the hand passed `MAX_CLOSING_FORCE_N` while closing, `MAX_REST_FORCE_N` when the
            gentle jaws rested, or the limit of `_max_N` while pressing. The jaws have opened again.
    """
    arm.felt.forget_near(arm.world.container.pose_B_K.inverse().apply(arm.pose_B_P.position_m))
    may_twist = force_N > MIN_TWISTING_N
    closing = _Closing(arm, speed_m_s, tactile or may_twist, on_observation)
    with arm.pause_signal.finishing():  # pause only at rest: until then the hand must be able to follow
        yield from closing.measure_free_force()
        state = yield from closing.until_rest([min(GENTLE_FORCE_N, force_N)])
        if force_N > GENTLE_FORCE_N:
            yield from closing.refuse_above(MAX_REST_FORCE_N, closing.rest_force_N)
            if may_twist and (apart_m := closing.contacts_apart_m()) > 0.0:
                force_N = max(min(force_N, MAX_TWIST_NM / apart_m), MIN_TWISTING_N)
            steps = int(np.ceil((force_N - GENTLE_FORCE_N) / (RAMP_N_S * arm.period_s) - 1e-9))
            state = yield from closing.until_rest(np.linspace(GENTLE_FORCE_N, force_N, steps + 1)[1:].tolist())
    return state


class _Closing:
    """State of one closure."""

    def __init__(self, arm: Arm, speed_m_s: float, tactile: bool, on_observation: Observer) -> None:
        self._arm, self._speed_m_s, self._tactile, self._seen_by = arm, speed_m_s, tactile, on_observation
        self._opening_m, self._start_B = arm.aperture_m, arm.pose_B_P.position_m
        self._free_N = self._force_N = np.zeros(3)
        self._untouched: list[TactileFrame] = []
        self._felt: TactileFrame | None = None

    def measure_free_force(self) -> Motion[None]:
        """Measure the force on the free hand, so that the wrist need not be tared. The pads are untouched meanwhile."""
        blocks = yield from self._arm.hold(BASELINE_S, tactile=self._tactile)
        for seen in blocks:
            self._seen_by(seen)
        self._free_N = np.mean([_force_P(self._arm, b) for b in blocks], axis=0)
        self._untouched = [b.tactile for b in blocks if b.tactile is not None]

    def contacts_apart_m(self) -> float:
        """Return the distance along x_P between the contacts of the two gels; 0 unless both feel the object."""
        if self._felt is None:
            return 0.0
        columns, width_m = self._felt.left_m.shape[1], self._arm.description.gripper.pad_window_m[0]
        middles = []
        for depth_m, noise_m in zip((self._felt.left_m, self._felt.right_m), pad_noise_m(self._untouched), strict=True):
            touched = patch_statistics(depth_m, noise_m=noise_m).mask
            if not touched.any():
                return 0.0
            middles.append(float(np.nonzero(touched)[1].mean()))
        return float(abs(middles[0] - middles[1]) / columns * width_m)

    @property
    def rest_force_N(self) -> float:
        """Difference of the force on the hand from the free hand's."""
        return float(np.linalg.norm(self._force_N - self._free_N))

    def refuse_above(self, max_N: float, pressed_N: float) -> Motion[None]:
        """Open the jaws and refuse if the force on the hand is above `max_N` or NaN."""
        if not pressed_N <= max_N:
            yield from release(self._arm, self._opening_m)
            raise MotionRefused("closing", f"the hand was pressed with {pressed_N:.0f} N while the jaws closed")

    def until_rest(self, forces_N: Sequence[float]) -> Motion[GripperState]:
        """Close under each force for one period, then under the last one until the jaws rest."""
        arm = self._arm
        watch = JawRestDetector(arm.period_s)
        for k in range(round(TIMEOUT_S / arm.period_s)):
            force_N = forces_N[min(k, len(forces_N) - 1)]
            seen = yield from self._one_period(force_N if k < len(forces_N) else None)
            self._force_N = _force_P(arm, seen)
            yield from self.refuse_above(_max_N(force_N), float(np.linalg.norm(self._force_N)))
            if k >= len(forces_N) and watch.still(seen.now_s, seen.gripper):
                break
            yield from self._follow(seen)
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
        self._felt = blocks[-1].tactile or self._felt
        return blocks[-1]

    def _follow(self, seen: Observation) -> Motion[None]:
        """Follow a jaw if it alone pushes."""
        arm, force = self._arm, float(_force_P(self._arm, seen)[1])
        if not (seen.gripper.moving and abs(force) > max(FOLLOW_FORCE_N, seen.gripper.force_N)):
            return
        side = float(np.sign(force))
        y_B = np.asarray(arm.pose_B_P.rotation[:, 1])
        followed = side * float((arm.pose_B_P.position_m - self._start_B) @ y_B)
        left = 0.5 * (self._opening_m - arm.aperture_m) - followed
        if left > MIN_STEP_M:
            yield from arm.shift(
                side * left * y_B,
                FOLLOW_SPEED_RATIO * self._speed_m_s,
                guard=_follow_guard(arm, side, self._seen_by),
                check=False,
                tactile=self._tactile,
                what="follow",
            )


def _max_N(jaw_N: float) -> float:
    """Return the force on the hand that ends a closure at this jaw force."""
    return (
        MAX_CLOSING_FORCE_N
        if jaw_N <= GENTLE_FORCE_N
        else min(max(MIN_PRESSING_LIMIT_N, PRESSING_LIMIT_SHARE * jaw_N), MAX_HAND_FORCE_N)
    )


def release(arm: Arm, opening_m: float) -> Motion[None]:
    """Open the jaws to `opening_m`, slowly and weakly until they have released the object.

    A force on the hand although the jaws hold nothing means that a fingertip stands on the object, or is caught under
    it or in a hollow of its side. Then the jaws stop, the hand moves along the force until it is free, and the jaws
    open again. The object may drop onto a fingertip only after its release, so the force is checked until the jaws are
    open. A pause waits until then. What the jaws have moved stands between the open
    fingers, so the places of the fingers are recorded as free.
    """
    with arm.pause_signal.finishing():
        yield from _release(arm, opening_m)
    note_open_fingers(arm)


def _release(arm: Arm, opening_m: float) -> Motion[None]:
    held, given, weak, since = arm.aperture_m, 0.0, True, 0
    watch = JawRestDetector(arm.period_s)
    yield from _drive_jaws(arm, opening_m, weak)
    for k in range(round(OPEN_TIMEOUT_S / arm.period_s)):
        (seen,) = yield from arm.hold(arm.period_s)
        force = _force_P(arm, seen)
        pressed = np.linalg.norm(force) > CAUGHT_FORCE_N
        still = watch.still(seen.now_s, seen.gripper)
        if pressed and not (weak and seen.gripper.force_N >= LOOSE_JAW_FORCE_N) and given < MAX_FREEING_M - MIN_STEP_M:
            yield from _drive_jaws(arm, arm.aperture_m, True)
            given += yield from _move_free(arm, force, MAX_FREEING_M - given)
            held, weak, since = arm.aperture_m, True, k
        elif weak and not pressed and arm.aperture_m > held + RELEASED_BY_M:
            weak = False
        elif still and not (weak and k < since + round(RELEASE_STALL_S / arm.period_s)):
            break
        else:
            continue
        watch = JawRestDetector(arm.period_s)
        yield from _drive_jaws(arm, opening_m, weak)


def _drive_jaws(arm: Arm, aperture_m: float, weak: bool) -> Motion[None]:
    """Command the jaws for one period."""
    speed_m_s, force_N = (RELEASE_SPEED_M_S, RELEASE_FORCE_N) if weak else (OPEN_SPEED_M_S, OPEN_FORCE_N)
    yield from arm.jaws(aperture_m, speed_m_s=speed_m_s, force_N=force_N, timeout_s=arm.period_s)


def _move_free(arm: Arm, force_P_N: Array, max_m: float) -> Motion[float]:
    """Move along the force (3,) until the hand is free, `max_m` at most; return the distance, at least `MIN_STEP_M`."""
    container, tip_m = arm.world.container, arm.description.gripper.fingertip_below_P_m
    way_B = arm.pose_B_P.rotation @ (force_P_N / np.linalg.norm(force_P_N))
    down = -float(container.pose_B_K.rotation[:, 2] @ way_B)
    height = float(container.pose_B_K.inverse().apply(arm.pose_B_P.position_m)[2]) - tip_m - MIN_TIP_HEIGHT_M
    length = max_m if down <= 0.0 else min(max_m, max(height, 0.0) / down)
    if length < MIN_STEP_M:
        return max_m
    moved = yield from arm.shift(
        length * way_B,
        FREEING_SPEED_M_S,
        guard=lambda seen: "free" if np.linalg.norm(_force_P(arm, seen)) < FREED_FORCE_N else None,
        check=False,
        what="free the hand",
    )
    return max(moved.travelled_m, MIN_STEP_M)


def _follow_guard(arm: Arm, side: float, on_observation: Observer) -> Callable[[Observation], str | None]:
    def guard(seen: Observation) -> str | None:
        on_observation(seen)
        force = _force_P(arm, seen)
        if not np.linalg.norm(force) <= MAX_HAND_FORCE_N:
            return "pressed"
        both = seen.gripper.force_N > max(FOLLOW_FORCE_N, side * force[1])
        return "released" if both or side * force[1] < RELEASED_FORCE_N else None

    return guard


def _force_P(arm: Arm, seen: Observation) -> Array:
    """Return the mean tared force (3,) of one period in P's axes."""
    return np.asarray(arm.rotation_P_S @ seen.wrench_S[:, :3].mean(axis=0))
