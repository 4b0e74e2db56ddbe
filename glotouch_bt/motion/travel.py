"""Playing planned motions, one setpoint a control period: guards that break them off, pauses that make them wait.

A pause (`PauseSignal`) stops a motion where it is along its path, softly; the guard keeps listening, and afterwards the
motion goes on along the same path under the same limits. A motion's caller never notices.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from glotouch_bt.motion.kinematics import Kinematics
from glotouch_bt.motion.pause_signal import BACK_OFF_M, BACK_OFF_M_S, PauseSignal
from glotouch_bt.motion.plan import Plan
from glotouch_bt.motion.timing import JointProfile, between, brake
from glotouch_bt.robot import Array, Command, JointSetpoint, Limits, Observation, Pose, RobotDescription

T = TypeVar("T")
Motion = Generator[Command, Observation, T]
Guard = Callable[[Observation], object | None]


@dataclass(frozen=True)
class MoveResult:
    """How a motion ended; the arm is at rest.

    Attributes:
        completed: The whole path was travelled.
        stop: What the guard returned, or None.
        travelled_m: Path length travelled, as commanded.
        path_B_m: (m, 3) measured position of P in B, newest sample of each period.
        pose_B_P: Measured pose of P in B at the end.
    """

    completed: bool
    stop: object | None
    travelled_m: float
    path_B_m: Array
    pose_B_P: Pose


@dataclass(frozen=True)
class BackedOff:
    """Where a hand backed off to: from `at_m` to `away_m` along a plan's path; what it was about to do, as it was."""

    plan: Plan
    at_m: float
    away_m: float
    q: Array


class _Trip:
    """What one guarded motion has sensed so far, and what its guard said.

    Attributes:
        guard: The guard, or None.
        stop: What it returned, once that was something.
        track: Measured positions of P in B, newest sample of each period.
        observation: The newest one.
    """

    def __init__(self, guard: Guard | None) -> None:
        self.guard = guard
        self.stop: object | None = None
        self.track: list[Array] = []
        self.observation: Observation | None = None

    def over(self) -> bool:
        """The guard has tripped."""
        return self.stop is not None

    def take(self, observation: Observation) -> None:
        """Keep what was sensed."""
        self.observation = observation
        self.track.append(observation.position_B_P[-1])

    def ask(self, observation: Observation, *, standing: bool = False) -> bool:
        """Ask the guard; True if it trips. One that knows how to listen at rest (`standing`) is asked that way."""
        guard = self.guard
        if standing:
            guard = getattr(guard, "standing", guard)
        if guard is None:
            return False
        self.stop = guard(observation)
        return self.stop is not None


class Mover:
    """The present setpoint, and what plays plans from there.

    Args:
        description: The robot's numbers.
        limits: For the guarded stop.
        period_s: Control period.

    Attributes:
        kinematics: Forward and inverse kinematics.
        pause_signal: Whether motions go on or are paused; the runner writes it.
    """

    def __init__(self, description: RobotDescription, limits: Limits, period_s: float) -> None:
        self.description, self.limits, self.period_s = description, limits, period_s
        self.kinematics = Kinematics(description)
        self._q: Array = self.kinematics.home.copy()
        self._aperture_m = description.gripper.stroke_m
        self.pause_signal = PauseSignal()
        self._touched: tuple[Plan, float] | None = None

    # -- where it is -------------------------------------------------------------------------------------------------

    @property
    def q(self) -> Array:
        """(dof,) present joint setpoint, rad."""
        return self._q

    @property
    def pose_B_P(self) -> Pose:
        """Pose of P in B at the present setpoint."""
        return self.kinematics.fk(self._q)

    @property
    def aperture_m(self) -> float:
        """Opening of the jaws as last seen; clearance is checked with it."""
        return self._aperture_m

    def sync(self, observation: Observation) -> None:
        """Take the measured joint positions and aperture as the present setpoint: at the start, after a preemption."""
        self._q = np.array(observation.q[-1])
        self._see(observation)

    def _see(self, observation: Observation) -> None:
        self._aperture_m = min(max(observation.gripper.aperture_m, 0.0), self.description.gripper.stroke_m)

    def _travel(self, plans: Sequence[Plan], guard: Guard | None, tactile: bool) -> Motion[MoveResult]:
        limits = self.limits
        trip = _Trip(guard)
        done_m, travelled = 0.0, 0.0
        if guard is not None and self.pause_signal.stops:  # its zero was taken just now, and must not grow old unheard
            with self.pause_signal.handling():
                yield from self._wait(trip, tactile)
        for plan in plans if not trip.over() else ():
            running: Plan | None = plan
            while running is not None:
                now, running = running, None
                k = yield from self._play(now, trip, tactile, breakable=True)
                travelled = float(now.progress.s[k])
                if trip.over():
                    halt = now.halt(k, limits.stop_acceleration_m_s2, limits.stop_jerk_m_s3, self.period_s)
                    if halt is not None:
                        yield from self._play(halt, trip, tactile)
                        travelled = float(halt.progress.s[-1])
                    self._touched = (plan, travelled)
                elif k < len(now) - 1 and self.pause_signal.stops:
                    travelled = yield from self._stand(now, k, trip, tactile)
                    if trip.over():
                        self._touched = (plan, travelled)
                    elif travelled < plan.piece.length_m - 1e-9:
                        running = plan.between(travelled, plan.piece.length_m, self.period_s)
            done_m += travelled
            if trip.over():
                break
        total = float(sum(p.piece.length_m for p in plans))
        path = np.array(trip.track).reshape(-1, 3)
        pose = self.pose_B_P if trip.observation is None else trip.observation.pose_B_P
        return MoveResult(done_m >= total - 1e-9, trip.stop, done_m, path, pose)

    def _play(self, plan: Plan, trip: _Trip, tactile: bool, *, breakable: bool = False) -> Motion[int]:
        """Command a plan's setpoints until it ends, the guard trips, or (`breakable`) a pause; the last one's number.

        Once the guard has tripped it is not asked again: what is played then is a halt.
        """
        listening = trip.guard is not None and trip.stop is None
        for k in range(len(plan)):
            self._q = plan.q[k]
            observation = yield Command(plan.setpoint(k), None, tactile)
            self._see(observation)
            if breakable:
                self._touched = None
            trip.take(observation)
            if listening and trip.ask(observation):
                return k
            if breakable and self.pause_signal.stops:
                return k
        return len(plan) - 1

    def _stand(self, plan: Plan, k: int, trip: _Trip, tactile: bool) -> Motion[float]:
        """Stop on the path after period `k`, back off if the pause says so, wait, listening; where it stands, m.

        If the guard trips on the way it is a contact as ever, and the pause is left to the next motion.
        """
        with self.pause_signal.handling():
            at_m = float(plan.progress.s[k])
            slower = plan.brake(k, self.period_s)
            legs: list[Plan] = []
            if slower is not None:
                at_m = min(float(slower.progress.s[-1]), plan.piece.length_m)
                legs.append(slower)
            if trip.guard is not None and self.pause_signal.style == "retreat" and at_m > 1e-6:
                legs.append(plan.between(at_m, max(0.0, at_m - BACK_OFF_M), self.period_s, BACK_OFF_M_S))
            for leg in legs:
                k = yield from self._play(leg, trip, tactile)
                if trip.over():
                    return (yield from self._halt(leg, k, trip, tactile))
                at_m = min(float(leg.progress.s[-1]), plan.piece.length_m)
            yield from self._wait(trip, tactile)
        return at_m

    def _wait(self, trip: _Trip, tactile: bool) -> Motion[None]:
        """Stand until the pause is over or the guard trips."""
        self.pause_signal.standing = True
        while self.pause_signal.stops:
            observation = yield Command(tactile=tactile)
            self._see(observation)
            trip.take(observation)
            if trip.ask(observation, standing=True):
                return

    def _halt(self, plan: Plan, k: int, trip: _Trip, tactile: bool) -> Motion[float]:
        """The guard's own hard stop, after period `k`; where it ends, m."""
        halt = plan.halt(k, self.limits.stop_acceleration_m_s2, self.limits.stop_jerk_m_s3, self.period_s)
        if halt is None:
            return float(plan.progress.s[k])
        yield from self._play(halt, trip, tactile)
        return float(halt.progress.s[-1])

    def back_off(self) -> Motion[BackedOff | None]:
        """Off what the last guarded motion met, the way it came; what `come_back` takes, or None: nothing was met."""
        if self._touched is None:
            return None
        plan, at_m = self._touched
        out = BackedOff(plan, at_m, max(0.0, at_m - BACK_OFF_M), self._q)
        if at_m - out.away_m < 1e-6:
            return None
        yield from self._play(plan.between(at_m, out.away_m, self.period_s, BACK_OFF_M_S), _Trip(None), False)
        return out

    def come_back(self, out: BackedOff) -> Motion[None]:
        """To where `back_off` began, as slowly."""
        way = out.plan.between(out.away_m, out.at_m, self.period_s, BACK_OFF_M_S)
        yield from self._play(way, _Trip(None), False)
        self._q = out.q

    def _turn(self, profile: JointProfile, *, breakable: bool = False) -> Motion[int | None]:
        """Command a joint profile; the period after which a pause broke it off, or None: it is done."""
        for k in range(len(profile.q)):
            self._q = profile.q[k]
            pose = self.kinematics.fk(self._q)
            self._see((yield Command(JointSetpoint(self._q, profile.dq[k], profile.ddq[k], pose))))
            self._touched = None
            if breakable and self.pause_signal.stops and k < len(profile.q) - 1:
                return k
        return None

    def _turn_on_later(self, profile: JointProfile, k: int) -> Motion[JointProfile | None]:
        """Stop a joint move after period `k`, wait until the pause is over; what is left of it."""
        at = float(profile.share.s[k])
        slower = brake(profile.share, k, profile.pace, self.period_s)
        with self.pause_signal.handling():
            if slower is not None:
                yield from self._turn(JointProfile.along(profile.start, profile.way, slower, profile.pace))
                at = min(float(slower.s[-1]), 1.0)
            yield from self._wait(_Trip(None), False)
        if at >= 1.0 - 1e-9:
            return None
        left = between(at, 1.0, profile.pace, self.period_s)
        return JointProfile.along(profile.start, profile.way, left, profile.pace)
