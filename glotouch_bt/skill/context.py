"""What the runner lends to every skill: the world, the arm, the record, the newest observation."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from glotouch_bt.robot import HOLD, Command, Observation, Request, Ticket, World
from glotouch_bt.skill.failures import NOT_AT_REST

if TYPE_CHECKING:
    from glotouch_bt.motion import Arm

SkillRun = Generator[Command, Observation, None]

REST_RAD_S, REST_PERIODS, LONGEST_BRAKING_PERIODS = 0.01, 5, 300
"""The arm stands once every joint was this slow for so many periods; it must within the last number of them."""


class Journal(Protocol):
    """Where skills write what they found; the runner's record implements it."""

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Record one event: `kind` (contact, candidate, touchset, ranking, ...) with JSON-able data or arrays."""
        ...


class RobotRequests(Protocol):
    """The part of a Robot a skill may call directly; everything else goes through yielded commands."""

    def start(self, request: Request) -> Ticket:
        """Begin a slow request; keep yielding and poll the ticket."""
        ...


@dataclass
class Context:
    """What the runner lends to every skill.

    Attributes:
        world: The nominal world.
        arm: Motion generators and the clearance scene.
        requests: Tare and payload.
        journal: The run's record.
        observation: The newest observation; set by the runner before each tick.
        command: What the active skill wants next; reset to hold by the runner before each tick.
        preempted: A skill was broken off, and no other has made sure since that the arm stands.
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
        """The clock of timeouts: the robot's, which stands still while the mission is paused."""
        return self.observation.now_s - self.paused_s


def come_to_rest(context: Context) -> SkillRun:
    """Hold until the braking arm stands, then plan from where it stands.

    Raises:
        SkillFailed: `not_at_rest` if it still moves after 300 control periods.
    """
    still = 0
    for _ in range(LONGEST_BRAKING_PERIODS):
        observation = yield HOLD
        still = still + 1 if bool((abs(observation.dq) < REST_RAD_S).all()) else 0
        if still >= REST_PERIODS:
            context.arm.sync(observation)
            context.preempted = False
            return
    raise NOT_AT_REST(NOT_AT_REST.meaning, joint_rad_s=float(abs(context.observation.dq).max()))
