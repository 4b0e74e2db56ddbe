"""The seam: one robot, one synchronous call a control period, in simulation and on hardware alike."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import TracebackType
from typing import Self

from glotouch_bt.robot.command import Command, Request, Ticket
from glotouch_bt.robot.description import RobotDescription
from glotouch_bt.robot.errors import BackendError
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.scene import Conditions, World
from glotouch_bt.robot.simulation import Disturber, Referee

Snapshot = Mapping[str, object]
"""Plain values, arrays, tuples, mappings, random generators and dataclasses, as `mission.values` can keep."""


class Robot(ABC):
    """An arm with a wrist force sensor and a tactile gripper. As a context manager it holds the arm on leaving.

    Attributes:
        description: Kinematics, inertia, limits, gripper.
        limits: The frozen limits the backend enforces below the skills.
        period_s: Control period; each `cycle` lets exactly this much time pass on the robot's clock.
        paced: The robot's clock is the wall's: it goes on whether or not `cycle` is called.
    """

    description: RobotDescription
    limits: Limits
    period_s: float
    paced: bool = False

    @abstractmethod
    def observe(self) -> Observation:
        """The newest block, without letting time pass (valid right after opening)."""

    @abstractmethod
    def cycle(self, command: Command) -> Observation:
        """Send one command, let one control period pass, return what was sensed in it.

        Raises:
            SafetyStop: A hard limit tripped; the arm is held, and every later cycle only holds and raises again.
            BackendError: The device or simulator failed; cause chained.
            ParamError: The command is not finite or breaks a joint limit; nothing was sent, the arm holds.
        """

    @abstractmethod
    def start(self, request: Request) -> Ticket:
        """Begin a slow request (tare, payload). Never blocks: keep cycling and poll the ticket."""

    @abstractmethod
    def hold(self) -> None:
        """Stop the arm where it is and keep it there. Safe to call at any time, any number of times; never raises."""

    @abstractmethod
    def close(self) -> None:
        """Hold, then release the device. Idempotent."""

    def snapshot(self) -> Snapshot | None:
        """The whole state of robot and world between two cycles, or None: it cannot be kept (any real device).

        A wrapper keeps what it wraps inside its own snapshot, and is None if that is.

        Raises:
            BackendError: The device or simulator has failed; its state is worth nothing.
        """
        return None

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot, of this robot or of another one opened with the same world, conditions, seed, options.

        The same commands then give the same observations, bit for bit. Tickets given before stay as they were.

        Raises:
            BadInput: It is of another backend, of another version, or of a robot that was opened otherwise.
            BackendError: This robot keeps no snapshots.
        """
        raise BackendError(f"{type(self).__name__} cannot be put back into an earlier state")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, tb: TracebackType | None
    ) -> None:
        self.hold()
        self.close()


class Backend(ABC):
    """What an entry point of the group `glotouch_bt.backends` provides: a factory of robots."""

    name: str
    summary: str

    @abstractmethod
    def open(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> Robot:
        """Connect or build, ready for the first cycle.

        Args:
            world: The nominal world.
            conditions: Disturbances to apply (a hardware backend ignores them).
            seed: Every random draw of the robot and its world comes from this.
            options: Backend options (`--set name=value` that no mission parameter takes).

        Raises:
            BadInput: The world cannot be built (objects that do not fit, unusable meshes, unknown options).
            BackendError: The device did not come up.
        """

    def referee(self, robot: Robot) -> Referee | None:
        """The truth about `robot`'s world, for scoring after the fact; None on hardware."""
        return None

    def disturber(self, robot: Robot) -> Disturber | None:
        """Hands inside `robot`'s world, for faults; None on hardware."""
        return None
