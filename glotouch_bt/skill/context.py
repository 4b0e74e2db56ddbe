"""Context that the runner gives to every skill: the world, the arm, the record, the newest observation."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from glotouch_bt.robot import HOLD, Command, Observation, Request, Ticket, World
from glotouch_bt.skill.failures import NOT_AT_REST

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

SkillRun = Generator[Command, Observation, None]

REST_RAD_S = 0.01
"""Joint speed below which a joint is at rest."""
REST_PERIODS = 5
"""Consecutive control periods for which every joint must be at rest."""
MAX_BRAKING_PERIODS = 300
"""Longest wait for the arm to come to rest, in control periods."""


class Journal(Protocol):
    """Receiver of the events that skills write; the runner's record implements it."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Record one event: `kind` (contact, candidate, touchset, ranking, ...) with JSON-able data or arrays."""


class RobotRequests(Protocol):
    """Requests that a skill may make of the robot directly; everything else goes through yielded commands."""

    def start(self, request: Request) -> Ticket:
        """Start a slow request; keep yielding and poll the ticket."""


@dataclass
class Context:
    """Context that the runner gives to every skill.

    Attributes:
        world: The nominal world.
        arm: Motion generators and the clearance scene.
        requests: Tare and payload.
        journal: The run's record.
        observation: The newest observation; set by the runner before each tick.
        command: Next command of the active skill; the runner resets it to hold before each tick.
        preempted: A skill was preempted, and no skill has waited since for the arm to come to rest.
        paused_s: Robot time so far in which the mission was paused.
    """

    world: World
    arm: Arm
    requests: RobotRequests
    journal: Journal
    observation: Observation
    command: Command = HOLD
    preempted: bool = False
    paused_s: float = 0.0

    @property
    def mission_s(self) -> float:
        """Mission clock for timeouts: the robot's, stopped during pauses."""
        return self.observation.now_s - self.paused_s


def come_to_rest(context: Context) -> SkillRun:
    """Hold until the braking arm is at rest, then plan from there.

    Raises:
        SkillFailed: `not_at_rest` if it still moves after 300 control periods.
    """
    still = 0
    for _ in range(MAX_BRAKING_PERIODS):
        observation = yield HOLD
        still = still + 1 if bool((abs(observation.dq) < REST_RAD_S).all()) else 0
        if still >= REST_PERIODS:
            context.arm.sync(observation)
            context.preempted = False
            return
    raise NOT_AT_REST(NOT_AT_REST.meaning, joint_rad_s=float(abs(context.observation.dq).max()))
