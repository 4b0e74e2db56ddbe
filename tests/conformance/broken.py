"""Wrappers that break one promise of a good backend each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from glotouch_bt.robot import BackendError, Command, JointSetpoint, Observation, Request, Robot, Ticket


class Wrapped(Robot):
    """Forwards every call."""

    def __init__(self, robot: Robot) -> None:
        self.inner = robot
        self.description, self.limits, self.period_s = robot.description, robot.limits, robot.period_s

    def changed(self, observation: Observation) -> Observation:
        return observation

    def observe(self) -> Observation:
        return self.changed(self.inner.observe())

    def cycle(self, command: Command) -> Observation:
        return self.changed(self.inner.cycle(command))

    def start(self, request: Request) -> Ticket:
        return self.inner.start(request)

    def hold(self) -> None:
        self.inner.hold()

    def close(self) -> None:
        self.inner.close()


class WrongSign(Wrapped):
    """Reports the wrench that the hand exerts, not the one it feels."""

    def changed(self, observation: Observation) -> Observation:
        return replace(observation, wrench_S=-np.asarray(observation.wrench_S))


class DroppedSamples(Wrapped):
    """One sample of every tenth block never arrives."""

    cycles = 0

    def cycle(self, command: Command) -> Observation:
        self.cycles += 1
        o = self.inner.cycle(command)
        if self.cycles % 10:
            return o
        keep = np.arange(len(o.stamp_s)) != 4
        names = ("stamp_s", "q", "dq", "position_B_P", "quat_B_P", "wrench_S")
        return replace(o, **{n: np.asarray(getattr(o, n))[keep] for n in names})


class LateStop(Wrapped):
    """Continues its last motion for 0.15 s after a hold."""

    last: JointSetpoint | None = None
    left = 0

    def cycle(self, command: Command) -> Observation:
        if command.motion is not None:
            o = super().cycle(command)
            self.last, self.left = command.motion, 15
            return o
        if self.last is not None and self.left > 0:
            self.left -= 1
            m = self.last
            self.last = replace(m, q=np.asarray(m.q) + self.period_s * np.asarray(m.dq), ddq=np.zeros_like(m.q))
            command = replace(command, motion=self.last)
        return super().cycle(command)


class Degrees(Wrapped):
    """Joint positions in degrees."""

    def changed(self, observation: Observation) -> Observation:
        return replace(observation, q=np.degrees(observation.q), dq=np.degrees(observation.dq))


class SwallowedFault(Wrapped):
    """Repeats the last observation when the device fails."""

    def cycle(self, command: Command) -> Observation:
        try:
            return super().cycle(command)
        except BackendError:
            return self.observe()


Break = Callable[[Robot], Wrapped]
