"""A supervised fake robot whose readings a test modifies."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from glotouch_bt.robot import HOLD, Command, JointSetpoint, Observation
from glotouch_bt.robot.fake import FakeRobot, forward
from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits
from glotouch_bt.robot.supervision.supervisor import Supervisor

Spoil = Callable[[Observation], Observation]


class Device(FakeRobot):
    """A fake robot whose readings a test modifies from one cycle to another; counts holds."""

    def __init__(self, spoil: Spoil | None = None, since: int = 0, until: int = 10**9, noise_N: float = 0.0) -> None:
        self._spoil, self._since, self._until, self._noise = spoil, since, until, noise_N
        self._rng = np.random.default_rng(7)
        self.holds = 0
        super().__init__()

    def cycle(self, command: Command) -> Observation:
        seen = super().cycle(command)
        if self._noise:
            wrench = seen.wrench_S + self._noise * self._rng.standard_normal(seen.wrench_S.shape)
            seen = dataclasses.replace(seen, wrench_S=wrench)
        if self._spoil is not None and self._since <= self.cycles - 1 < self._until:
            seen = self._spoil(seen)
        return seen

    def hold(self) -> None:
        self.holds += 1


def supervised(device: FakeRobot, **rules: float) -> tuple[Supervisor, list[GuardFinding]]:
    found: list[GuardFinding] = []
    robot = Supervisor(device, SupervisionLimits(**rules))  # type: ignore[arg-type]
    robot.on_finding = found.append
    return robot, found


def setpoint(q: Any, dq: Any = None) -> Command:
    q = np.asarray(q, dtype=np.float64)
    dq = np.zeros(7) if dq is None else np.asarray(dq, dtype=np.float64)
    return Command(JointSetpoint(q, dq, np.zeros(7), forward(FakeRobot().description, np.nan_to_num(q))))


def spin(robot: Supervisor, cycles: int, command: Command = HOLD) -> None:
    for _ in range(cycles):
        robot.cycle(command)


def with_part(name: str, row: int, column: int, value: float) -> Spoil:
    def spoil(seen: Observation) -> Observation:
        part = np.array(getattr(seen, name))
        part[row, column] = value
        return dataclasses.replace(seen, **{name: part})

    return spoil


def all_of(name: str, column: int, value: float) -> Spoil:
    def spoil(seen: Observation) -> Observation:
        part = np.array(getattr(seen, name))
        part[:, column] = value
        return dataclasses.replace(seen, **{name: part})

    return spoil


def jaws(**changes: Any) -> Spoil:
    return lambda seen: dataclasses.replace(seen, gripper=dataclasses.replace(seen.gripper, **changes))


def stamps(change: Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]) -> Spoil:
    return lambda seen: dataclasses.replace(seen, stamp_s=change(np.array(seen.stamp_s)))
