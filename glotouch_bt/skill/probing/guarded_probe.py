"""Guarded moves of the held probe. All positions are ball centres in K."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from glotouch_bt.motion import FREE_M_S, Motion, MoveResult, SpeedSteps
from glotouch_bt.perception.touch import (
    Baseline,
    Contact,
    ContactGuard,
    GuardParams,
    HardStop,
    HardTrip,
    MeasuredInertia,
    Onset,
    Payload,
    estimate_push,
    fit_baseline,
    settled,
)
from glotouch_bt.robot import Array, MotionRefused, Observation, Pose
from glotouch_bt.skill.context import Context
from glotouch_bt.skill.failures import Failure, SkillFailed
from glotouch_bt.skill.probing.held_tool import HeldTool

REST_S = 0.12
"""Time for which wrench and twist must be steady before a guarded move."""
MAX_REST_S = 0.6
"""Longest wait for that."""
SAME_REST_S = 0.03
"""Time for which the wrench must be steady and equal to that of an earlier rest, which then still holds. Source: ours;
three control periods at 100 Hz."""
SAME_SHARE = 1.0 / 6.0
"""Largest force or torque by which it may differ, over the threshold of a contact. Source: ours."""
SAME_SIGMAS = 3.0
"""The same in standard deviations of the difference, for noisy sensors. Source: ours."""
FIXTURE_M = 0.003
"""A contact within this distance of the floor or a wall is one with the container, which cannot be pushed. Source:
ours; twice the registration's error (conditions/harsh.yaml)."""
SETTLE_S = 0.02
"""Rest after a contact before the force on the bent probe is read. Source: ours; the sensor's latency, and the ringing
of a compliant probe (40 Hz, damped by the gel)."""
GUARDED_ACCELERATION_M_S2 = 0.5
"""Acceleration limit of a guarded move. With the hand's inertia compensated, less than 0.05 N of it remain at the tip
(simulation)."""
GUARDED_JERK_M_S3 = 20.0
"""Jerk limit of a guarded move, from the same simulation."""

HARD_CONTACT = Failure(
    "hard_contact",
    "the wrench passed a hard limit during a guarded move",
    advice="something hard or heavy is in the way; go slower",
)


@dataclass(frozen=True)
class Stood:
    """The ball as it is believed to be while the hand rests in contact.

    Attributes:
        hand_K_m: (3,) measured position of the unloaded ball's centre, which the hand carries.
        force_K_N: (3,) force on the ball.
    """

    hand_K_m: Array
    force_K_N: Array


@dataclass(frozen=True)
class Probed:
    """Outcome of one guarded move of the tip.

    Attributes:
        contact: What stopped it, or None if it ran its whole way.
        path_K_m: (n, 3) where the tip's centre has been, one row a control period.
    """

    contact: Contact | None
    path_K_m: Array


class Prober:
    """Move the ball of the held probe, guarded by the wrist sensor.

    Args:
        context: The skill's context.
        tool: The held probe.
        guard: Contact thresholds; the sensor's latency is taken from the tool.
        carried: Load below the wrist; by default the described hand, and the world's probe if it is held.

    Attributes:
        resting_up_N: Upward force on the wrist at each rest so far.
    """

    FAILURES: ClassVar = (HARD_CONTACT,)

    def __init__(self, context: Context, tool: HeldTool, guard: GuardParams, *, carried: Payload | None = None) -> None:
        self._context, self._tool = context, tool
        self._guard = replace(guard, latency_s=tool.latency_s)
        self._world = context.world
        self._pose_K_B = context.world.container.pose_B_K.inverse()
        probe = context.world.probe if context.arm.scene.holding_tool else None
        self._carried = carried or Payload.hand(context.arm.description.gripper, probe)
        self._rested: tuple[float, Baseline] | None = None
        self._last_guard: _TwoGuards | None = None
        self.resting_up_N: list[float] = []

    @property
    def tip_K_m(self) -> Array:
        """(3,) commanded position of the ball's centre."""
        return self._tool.tip_K_m(self._world, self._context.arm.pose_B_P)

    def rest(self) -> Motion[Baseline]:
        """Hold still until wrench and twist have settled, at most `MAX_REST_S`; return the wrench without contact.

        If no time has passed since the last rest, or the wrench is the same as then, return its result.
        """
        known = self._rested
        if known is not None and known[0] == self._context.observation.now_s:
            return known[1]
        period_s = self._context.arm.period_s
        short = round(SAME_REST_S / period_s)
        window: deque[Observation] = deque(maxlen=round(REST_S / period_s))
        for _ in range(round(MAX_REST_S / period_s)):
            (seen,) = yield from self._context.arm.hold(period_s)
            if window and seen.stamp_s[0] - window[-1].now_s > period_s:
                window.clear()  # a pause: samples from before it are too old
            window.append(seen)
            if known is not None and len(window) >= short and self._is_same(known[1], list(window)[-short:]):
                self._rested = (window[-1].now_s, known[1])
                return known[1]
            if len(window) == window.maxlen and settled(list(window)):
                break
        inertia = self._inertia()  # at rest this is only its measurement noise
        baseline = fit_baseline(np.concatenate([o.wrench_S - inertia(o) for o in window]))
        self._rested = (window[-1].now_s, baseline)
        self.resting_up_N.append(float((self._context.arm.pose_B_P.rotation @ baseline.median[:3])[2]))
        return baseline

    def _is_same(self, known: Baseline, window: list[Observation]) -> bool:
        """Return True if the hand rests and feels the wrench of an earlier rest, measured once more in less time."""
        if not settled(window):
            return False
        inertia = self._inertia()
        wrench = np.concatenate([o.wrench_S - inertia(o) for o in window])
        change = np.abs(wrench.mean(axis=0) - known.median)
        noise = SAME_SIGMAS * known.sd * math.sqrt(1.0 / len(wrench) + known.median_variance)
        threshold = np.repeat([self._guard.total_N, self._guard.moment_Nm], 3)
        return bool((change <= np.maximum(noise, SAME_SHARE * threshold)).all())

    def move(
        self, tip_K_m: Array, speed_m_s: float, *, any_direction: bool = False, speed_steps: SpeedSteps = ()
    ) -> Motion[Probed]:
        """Move the ball straight to `tip_K_m` (3,) under a guard; `speed_steps` as in `Arm.follow`.

        Stop at the first contact that opposes the motion or, with `any_direction`, at any contact, even a graze.

        Raises:
            SkillFailed: `hard_contact`; the arm has stopped.
            MotionRefused: The way is not clear.
        """
        step = np.asarray(tip_K_m, dtype=np.float64) - self.tip_K_m
        length = float(np.linalg.norm(step))
        if length < 1e-4:
            return Probed(None, self.tip_K_m[None, :])
        step_B = self._world.container.pose_B_K.rotation @ step
        guard = yield from self._guard_for(step_B / length, any_direction)
        result = yield from self._context.arm.shift(
            step_B,
            speed_m_s,
            acceleration_m_s2=GUARDED_ACCELERATION_M_S2,
            jerk_m_s3=GUARDED_JERK_M_S3,
            speed_steps=speed_steps,
            guard=guard,
        )
        self._last_guard = guard
        probed = yield from self._outcome(result, step / length)
        self._remember(probed)
        return probed

    def stand(self, duration_s: float) -> Motion[Stood]:
        """Rest in contact after a `move`; return the means of the hand's place and of the force over the last half.

        The force is measured from the baseline of that move.
        """
        guard = self._last_guard
        if guard is None:
            raise MotionRefused("stand", "no guarded move came before")
        blocks = yield from self._context.arm.hold(duration_s)
        rest = blocks[len(blocks) // 2 :]
        tips = [self._tool.tip_K_m(self._world, Pose(o.position_B_P.mean(axis=0), o.quat_B_P[-1])) for o in rest]
        force_B = np.mean([guard.soft.force_B_N(o) for o in rest], axis=0)
        return Stood(np.mean(tips, axis=0), self._pose_K_B.rotation @ force_B)

    def press(self, direction_K: Array, distance_m: float, speed_m_s: float, force_N: float) -> Motion[None]:
        """Move on along `direction_K` (3,) after a contact, at most until `force_N` opposes the motion.

        Raises:
            SkillFailed: `hard_contact`; the arm has stopped.
        """
        guard = self._last_guard
        if guard is None:
            raise MotionRefused("press", "no guarded move came before")
        step_B = self._world.container.pose_B_K.rotation @ (np.asarray(direction_K) * distance_m)
        limit = _ForceLimit(guard, -step_B / distance_m, force_N)
        result = yield from self._context.arm.shift(step_B, speed_m_s, guard=limit)
        if isinstance(result.stop, HardTrip):
            raise _hard_contact(result.stop)

    def _remember(self, probed: Probed) -> None:
        """Record where the tool was free, and where it touched anything but the container."""
        touch, interior = probed.contact, self._world.container.interior_m
        if touch is not None:
            walls = np.abs(touch.point_K_m[:2]) > 0.5 * np.array(interior[:2]) - FIXTURE_M
            floor = touch.tip_K_m[2] - self._tool.tip_radius_m < self._tool.floor_z_K_m + FIXTURE_M
            if walls.any() or floor:
                touch = None
        self._context.arm.felt.add(probed.path_K_m, None if touch is None else touch.point_K_m)

    def retreat(self, direction_K: Array, distance_m: float, speed_m_s: float) -> Motion[None]:
        """Move away from a contact along `direction_K` (3,), unguarded, then rest until the wrench has settled."""
        step_B = self._world.container.pose_B_K.rotation @ (np.asarray(direction_K) * distance_m)
        yield from self._context.arm.shift(step_B, speed_m_s)
        yield from self.rest()

    def hop(self, tip_K_m: Array, height_K_m: float, speed_m_s: float) -> Motion[None]:
        """Raise the ball's centre to `height_K_m`, then move across to above `tip_K_m`, unguarded.

        It is raised at `FREE_M_S` at most: something may reach over the ball beside the shaft.
        """
        tip = self.tip_K_m
        for goal, speed in (
            (np.array([tip[0], tip[1], height_K_m]), min(speed_m_s, FREE_M_S)),
            (np.array([tip_K_m[0], tip_K_m[1], height_K_m]), speed_m_s),
        ):
            if np.linalg.norm(goal - self.tip_K_m) > 1e-4:
                yield from self._context.arm.line(self._tool.pose_B_P(self._world, goal), speed)

    def _guard_for(self, direction_B: Array, any_direction: bool) -> Motion[_TwoGuards]:
        baseline = yield from self.rest()
        arm, params = self._context.arm, self._guard
        gripper = arm.description.gripper
        inertial = self._inertia()
        approach_B = None if any_direction else direction_B
        soft = ContactGuard(baseline, approach_B, self._tool.tip_P_m, gripper.pose_E_P, params, inertial)
        return _TwoGuards(HardStop(baseline, params), soft)

    def _inertia(self) -> MeasuredInertia:
        gripper = self._context.arm.description.gripper
        return MeasuredInertia(self._carried, gripper.pose_E_P, self._guard.latency_s)

    def _outcome(self, result: MoveResult, approach_K: Array) -> Motion[Probed]:
        poses = result.path_B_m + self._context.arm.pose_B_P.rotation @ self._tool.tip_P_m
        path_K = self._pose_K_B.apply(poses)
        stop = result.stop
        if stop is None:
            return Probed(None, path_K)
        if isinstance(stop, HardTrip):
            raise _hard_contact(stop)
        if not isinstance(stop, Onset):
            raise MotionRefused("guarded move", f"the guard answered {stop!r}, not an onset")
        stood = yield from self.stand(SETTLE_S)
        return Probed(self._contact(stop, approach_K, stood), path_K)

    def _contact(self, onset: Onset, approach_K: Array, stood: Stood) -> Contact:
        """Return the contact. At its onset nothing presses yet; at rest the probe is bent by the force."""
        pose = Pose(onset.position_B_P, onset.quat_B_P)
        tip_K = self._tool.tip_K_m(self._world, pose)
        force_K = self._pose_K_B.rotation @ onset.force_B
        norm = float(np.linalg.norm(force_K))
        reaction = force_K / norm if norm > 1e-6 else -approach_K
        point = self._tool.contact_point_K_m(self._world, pose, approach_K, reaction)
        ball_K_m = stood.hand_K_m + self._tool.deflection_K_m(self._world, pose, stood.force_K_N)
        push = estimate_push((ball_K_m - tip_K)[:2], reaction[:2])
        return Contact(onset.stamp_s, tip_K, approach_K, reaction, point, norm, push)


class _TwoGuards:
    """Apply the hard and the soft rule to the same samples; a hard stop takes precedence."""

    def __init__(self, hard: HardStop, soft: ContactGuard) -> None:
        self.hard, self.soft = hard, soft

    def __call__(self, observation: Observation) -> HardTrip | Onset | None:
        return self.hard(observation) or self.soft(observation)

    def standing(self, observation: Observation) -> HardTrip | Onset | None:
        """Check while a paused motion stands still."""
        return self.hard(observation) or self.soft.standing(observation)


class _ForceLimit:
    """Trip on the hard rule, or on a mean force of a period along `against_B` (3,) of `max_N` and more."""

    def __init__(self, guards: _TwoGuards, against_B: Array, max_N: float) -> None:
        self._guards, self._against_B, self._max_N = guards, against_B, max_N

    def __call__(self, observation: Observation) -> HardTrip | float | None:
        force_N = float(self._guards.soft.force_B_N(observation) @ self._against_B)
        return self._guards.hard(observation) or (force_N if force_N >= self._max_N else None)


def _hard_contact(trip: HardTrip) -> SkillFailed:
    return HARD_CONTACT(
        f"{trip.quantity} {trip.value:.1f} passed its limit {trip.limit:.1f} during a guarded move",
        quantity=trip.quantity,
        value=trip.value,
        limit=trip.limit,
    )
