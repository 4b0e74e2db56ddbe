"""Execution of planned motions, one setpoint per control period, with guards and pauses.

A pause (`PauseSignal`) brakes a motion on its path under the motion's own limits. The guard stays active meanwhile, and
the motion resumes on the same path. The caller of a motion does not see a pause.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from glotouch_bt.motion.kinematics import Kinematics
from glotouch_bt.motion.pause_signal import RETREAT_M, RETREAT_M_S, PauseSignal
from glotouch_bt.motion.plan import MotionPlan
from glotouch_bt.motion.timing import JointProfile, between, brake
from glotouch_bt.robot import Array, Command, JointSetpoint, Limits, Observation, Pose, RobotDescription

T = TypeVar("T")
Asked = TypeVar("Asked")
Answer = TypeVar("Answer")
Motion = Generator[Command, Observation, T]
Guard = Callable[[Observation], object | None]


def drive(plan: Generator[Asked, Answer, T], answer: Callable[[Asked], Answer]) -> T:
    """Run a generator to its end, a motion or a search plan: send the answer to each value; return its result."""
    try:
        asked = next(plan)
        while True:
            asked = plan.send(answer(asked))
    except StopIteration as end:
        result: T = end.value
        return result


@dataclass(frozen=True)
class MoveResult:
    """Result of a motion; the arm is at rest.

    Attributes:
        completed: The whole path was travelled.
        stop: Value returned by the guard, or None.
        travelled_m: Commanded path length.
        path_B_m: (m, 3) measured positions of P in B, newest sample of each period.
        pose_B_P: Measured pose of P in B at the end.
    """

    completed: bool
    stop: object | None
    travelled_m: float
    path_B_m: Array
    pose_B_P: Pose


@dataclass(frozen=True)
class Retreat:
    """A retreat along a plan's path from the contact at `at_m` to `away_m`, with the setpoint `q` (dof,) before it."""

    plan: MotionPlan
    at_m: float
    away_m: float
    q: Array


class _GuardState:
    """State of one guarded motion.

    Attributes:
        guard: The guard, or None.
        stop: Value returned by the tripped guard; None before.
        track: Measured positions of P in B, newest sample of each period.
        observation: The newest observation.
    """

    def __init__(self, guard: Guard | None) -> None:
        self.guard = guard
        self.stop: object | None = None
        self.track: list[Array] = []
        self.observation: Observation | None = None

    def tripped(self) -> bool:
        """Return True once the guard has tripped."""
        return self.stop is not None

    def take(self, observation: Observation) -> None:
        """Record an observation."""
        self.observation = observation
        self.track.append(observation.position_B_P[-1])

    def ask(self, observation: Observation, *, standing: bool = False) -> bool:
        """Evaluate the guard, through its `standing` method if the arm stands and it has one; True if it trips."""
        guard = self.guard
        if standing:
            guard = getattr(guard, "standing", guard)
        if guard is None:
            return False
        self.stop = guard(observation)
        return self.stop is not None


class Mover:
    """Current setpoint of an arm, and execution of plans from there.

    Args:
        description: Robot data.
        limits: Limits of the guarded stop.
        period_s: Control period.

    Attributes:
        kinematics: Forward and inverse kinematics.
        pause_signal: Pause state, written by the runner.
    """

    def __init__(self, description: RobotDescription, limits: Limits, period_s: float) -> None:
        self.description, self.limits, self.period_s = description, limits, period_s
        self.kinematics = Kinematics(description)
        self._q: Array = self.kinematics.home.copy()
        self._aperture_m = description.gripper.stroke_m
        self.pause_signal = PauseSignal()
        self._last_contact: tuple[MotionPlan, float] | None = None

    # -- where it is -------------------------------------------------------------------------------------------------

    @property
    def q(self) -> Array:
        """(dof,) current joint setpoint, rad."""
        return self._q

    @property
    def pose_B_P(self) -> Pose:
        """Pose of P in B at the current setpoint."""
        return self.kinematics.fk(self._q)

    @property
    def aperture_m(self) -> float:
        """Last measured jaw aperture, used for clearance checks."""
        return self._aperture_m

    def sync(self, observation: Observation) -> None:
        """Set the setpoint to the measured joint positions and aperture: at the start and after a preemption."""
        self._q = np.array(observation.q[-1])
        self._see(observation)

    def _see(self, observation: Observation) -> None:
        self._aperture_m = min(max(observation.gripper.aperture_m, 0.0), self.description.gripper.stroke_m)

    def _travel(self, plans: Sequence[MotionPlan], guard: Guard | None, tactile: bool) -> Motion[MoveResult]:
        trip = _GuardState(guard)
        done_m, travelled = 0.0, 0.0
        if guard is not None and self.pause_signal.stops:  # keep the fresh baseline of the guard up to date
            with self.pause_signal.handling():
                yield from self._wait(trip, tactile)
        for plan in plans if not trip.tripped() else ():
            running: MotionPlan | None = plan
            while running is not None:
                now, running = running, None
                k = yield from self._play(now, trip, tactile, pausable=True)
                travelled = float(now.progress.s[k])
                if trip.tripped():
                    travelled = yield from self._halt(now, k, trip, tactile)
                elif k < len(now) - 1 and self.pause_signal.stops:
                    travelled = yield from self._pause(now, k, trip, tactile)
                    if not trip.tripped() and travelled < plan.piece.length_m - 1e-9:
                        running = plan.between(travelled, plan.piece.length_m, self.period_s)
                if trip.tripped():
                    self._last_contact = (plan, travelled)
            done_m += travelled
            if trip.tripped():
                break
        total = float(sum(p.piece.length_m for p in plans))
        path = np.array(trip.track).reshape(-1, 3)
        pose = self.pose_B_P if trip.observation is None else trip.observation.pose_B_P
        return MoveResult(done_m >= total - 1e-9, trip.stop, done_m, path, pose)

    def _play(self, plan: MotionPlan, trip: _GuardState, tactile: bool, *, pausable: bool = False) -> Motion[int]:
        """Command a plan's setpoints until it ends, the guard trips or (`pausable`) a pause; return the last index.

        A guard that has tripped is not evaluated again: the plan is then its stop.
        """
        listening = trip.guard is not None and trip.stop is None
        for k in range(len(plan)):
            self._q = plan.q[k]
            observation = yield Command(plan.setpoint(k), None, tactile)
            self._see(observation)
            if pausable:
                self._last_contact = None
            trip.take(observation)
            if listening and trip.ask(observation):
                return k
            if pausable and self.pause_signal.stops:
                return k
        return len(plan) - 1

    def _pause(self, plan: MotionPlan, k: int, trip: _GuardState, tactile: bool) -> Motion[float]:
        """Brake after period `k`, back off if the style is `retreat`, wait; return the path coordinate at the end, m.

        If the guard trips meanwhile, the motion ends with that contact and the next motion handles the pause.
        """
        with self.pause_signal.handling():
            at_m = float(plan.progress.s[k])
            slower = plan.halt(k, plan.limits.acceleration, plan.limits.jerk, self.period_s)
            legs: list[MotionPlan] = []
            if slower is not None:
                at_m = min(float(slower.progress.s[-1]), plan.piece.length_m)
                legs.append(slower)
            if trip.guard is not None and self.pause_signal.style == "retreat" and at_m > 1e-6:
                legs.append(plan.between(at_m, max(0.0, at_m - RETREAT_M), self.period_s, RETREAT_M_S))
            for leg in legs:
                k = yield from self._play(leg, trip, tactile)
                if trip.tripped():
                    return (yield from self._halt(leg, k, trip, tactile))
                at_m = min(float(leg.progress.s[-1]), plan.piece.length_m)
            yield from self._wait(trip, tactile)
        return at_m

    def _wait(self, trip: _GuardState, tactile: bool) -> Motion[None]:
        """Hold until the pause is over or the guard trips."""
        self.pause_signal.standing = True
        while self.pause_signal.stops:
            observation = yield Command(tactile=tactile)
            self._see(observation)
            trip.take(observation)
            if trip.ask(observation, standing=True):
                return

    def _halt(self, plan: MotionPlan, k: int, trip: _GuardState, tactile: bool) -> Motion[float]:
        """Stop under the stop limits after period `k`; return the path coordinate at the end, m."""
        halt = plan.halt(k, self.limits.stop_acceleration_m_s2, self.limits.stop_jerk_m_s3, self.period_s)
        if halt is None:
            return float(plan.progress.s[k])
        yield from self._play(halt, trip, tactile)
        return float(halt.progress.s[-1])

    def retreat(self) -> Motion[Retreat | None]:
        """Retreat from the last guarded contact along its path; return None if there was no contact."""
        if self._last_contact is None:
            return None
        plan, at_m = self._last_contact
        out = Retreat(plan, at_m, max(0.0, at_m - RETREAT_M), self._q)
        if at_m - out.away_m < 1e-6:
            return None
        yield from self._play(plan.between(at_m, out.away_m, self.period_s, RETREAT_M_S), _GuardState(None), False)
        return out

    def return_to_contact(self, out: Retreat) -> Motion[None]:
        """Return to the contact that `retreat` left."""
        way = out.plan.between(out.away_m, out.at_m, self.period_s, RETREAT_M_S)
        yield from self._play(way, _GuardState(None), False)
        self._q = out.q

    def _play_joints(self, profile: JointProfile, *, pausable: bool = False) -> Motion[int | None]:
        """Command a joint profile; return the period after which a pause interrupted it, or None at its end."""
        for k in range(len(profile.q)):
            self._q = profile.q[k]
            pose = self.kinematics.fk(self._q)
            self._see((yield Command(JointSetpoint(self._q, profile.dq[k], profile.ddq[k], pose))))
            self._last_contact = None
            if pausable and self.pause_signal.stops and k < len(profile.q) - 1:
                return k
        return None

    def _pause_joints(self, profile: JointProfile, k: int) -> Motion[JointProfile | None]:
        """Brake a joint move after period `k`, wait for the end of the pause, and return the remaining move."""
        at = float(profile.share.s[k])
        slower = brake(profile.share, k, profile.limits.acceleration, profile.limits.jerk, self.period_s)
        with self.pause_signal.handling():
            if slower is not None:
                yield from self._play_joints(JointProfile.along(profile.start, profile.way, slower, profile.limits))
                at = min(float(slower.s[-1]), 1.0)
            yield from self._wait(_GuardState(None), False)
        if at >= 1.0 - 1e-9:
            return None
        left = between(at, 1.0, profile.limits, self.period_s)
        return JointProfile.along(profile.start, profile.way, left, profile.limits)
