"""A wrist that does not feel the hand's own motion is dead or late, with noise or without."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from glotouch_bt.robot import Command, GuardTripped, JointSetpoint, Observation
from glotouch_bt.robot.fake import FakeRobot, forward
from glotouch_bt.robot.supervision.limits import GuardFinding
from glotouch_bt.robot.supervision.supervisor import Supervisor

Array = np.ndarray[Any, Any]
WEIGHT = np.array([0.0, 0.0, 8.7, 0.0, 0.0, 0.0])


class Heavy(FakeRobot):
    """A fake arm whose wrist feels the inertia of the hand; a test alters what it reports."""

    def __init__(self, noise_N: float, alter: Callable[[Array], Array]) -> None:
        super().__init__()
        self.description = dataclasses.replace(self.description, wrist_feels_inertia=True)
        self._rng, self._noise, self._alter = np.random.default_rng(5), noise_N, alter
        self._track = [self.observe().position_B_P[-1]] * 3
        self._mass_kg = self.description.gripper.mass_and_com_E()[0]

    def cycle(self, command: Command) -> Observation:
        seen = super().cycle(command)
        self._track = [*self._track[1:], seen.position_B_P[-1]]
        a, b, c = self._track
        wrench = self._noise * self._rng.standard_normal(seen.wrench_S.shape)
        wrench[:, :3] -= self._mass_kg * (c - 2.0 * b + a) / self.period_s**2
        return dataclasses.replace(seen, wrench_S=self._alter(wrench))


def swing(robot: Supervisor, seconds: float = 1.0, speed_rad_s: float = 0.12) -> list[GuardFinding]:
    """Stand, then swing the elbow to and fro once; return the findings."""
    found: list[GuardFinding] = []
    robot.on_finding = found.append
    home = np.array(robot.description.home_q)
    for _ in range(10):
        robot.cycle(Command())
    for k in range(round(seconds / 0.01)):
        t = 0.01 * k / seconds * 2.0 * np.pi
        q = home + speed_rad_s * seconds / (2.0 * np.pi) * (1.0 - np.cos(t)) * np.eye(7)[3]
        dq = speed_rad_s * np.sin(t) * np.eye(7)[3]
        robot.cycle(Command(JointSetpoint(q, dq, np.zeros(7), forward(robot.description, q))))
    return found


def late(samples: int) -> Callable[[Array], Array]:
    line = np.zeros((samples, 6))

    def alter(wrench: Array) -> Array:
        nonlocal line
        line = np.concatenate([line, wrench])
        out, line = line[:10], line[10:]
        return out

    return alter


@pytest.mark.parametrize("noise_N", [0.0, 0.05, 0.15])
@pytest.mark.parametrize("change", [lambda w: w, late(8), lambda w: w + WEIGHT, lambda w: 0.5 * w, np.negative])
def test_a_living_wrist_passes(noise_N: float, change: Callable[[Array], Array]) -> None:
    """Also one that is never tared, or has a wrong gain: others notice those."""
    assert swing(Supervisor(Heavy(noise_N, change))) == []


@pytest.mark.parametrize(
    "change",
    [lambda w: 0.0 * w, lambda w: 0.0 * w + WEIGHT, late(526), lambda w: np.clip(w, -0.02, 0.02)],
    ids=["zero", "stuck", "half a second late", "saturated"],
)
def test_wrench_silent__before_the_hand_is_fast(change: Callable[[Array], Array]) -> None:
    robot = Supervisor(Heavy(0.0, change))
    with pytest.raises(GuardTripped, match="wrench_silent") as trip:
        swing(robot, 0.8, 0.4)
    assert trip.value.stamp_s < 0.25


def silent(begin: int, end: int) -> Callable[[Array], Array]:
    """Return a change that shows no force in the blocks `begin` to `end` - 1."""
    blocks = 0

    def alter(wrench: Array) -> Array:
        nonlocal blocks
        blocks += 1
        return 0.0 * wrench if begin <= blocks < end else wrench

    return alter


def test_a_contact_that_stops_the_hand_cancels_its_inertia() -> None:
    """`swing` gains speed in the blocks 11 to 30, and loses it in 31 to 50 and 71 to 90."""
    assert swing(Supervisor(Heavy(0.0, silent(34, 48))), 0.8, 0.4) == []


def test_a_wrist_that_dies_is_found_when_the_hand_gains_speed_again() -> None:
    with pytest.raises(GuardTripped, match="wrench_silent") as trip:
        swing(Supervisor(Heavy(0.0, silent(34, 1000))), 0.8, 0.4)
    assert trip.value.stamp_s < 0.65


def test_a_robot_without_physics_is_not_judged() -> None:
    assert swing(Supervisor(FakeRobot())) == []
