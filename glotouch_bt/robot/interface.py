"""The interface of every robot and backend: one synchronous call a control period, in simulation and on hardware."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Self

import numpy as np
import numpy.typing as npt

from glotouch_bt.errors import BackendError
from glotouch_bt.robot.command import Command, Request, Ticket
from glotouch_bt.robot.description import RobotDescription
from glotouch_bt.robot.limits import Limits
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.scene import Conditions, World
from glotouch_bt.robot.simulation import Disturber, Referee, TouchSampler

Snapshot = Mapping[str, object]
"""Plain values, arrays, tuples, mappings, random generators and dataclasses, as a checkpoint can encode them."""
Picture = npt.NDArray[np.uint8]
"""A picture (height, width, 3), RGB."""


class Robot(ABC):
    """An arm with a wrist force sensor and a tactile gripper. As a context manager it holds the arm on exit.

    Attributes:
        description: Kinematics, inertia, limits, gripper.
        limits: Limits that the backend enforces below the skills.
        period_s: Control period; each `cycle` lets this much time pass on the robot's clock.
        paced: True if the robot's clock runs with wall time, whether or not `cycle` is called.
    """

    description: RobotDescription
    limits: Limits
    period_s: float
    paced: bool = False

    @abstractmethod
    def observe(self) -> Observation:
        """Return the newest block without letting time pass; valid right after opening."""

    @abstractmethod
    def cycle(self, command: Command) -> Observation:
        """Send one command, let one control period pass, return what was sensed in it.

        Raises:
            SafetyStop: A hard limit tripped; the arm is held, and every later cycle holds and raises again.
            BackendError: The device or simulator failed; cause chained.
            ParamError: The command is not finite or breaks a joint limit; nothing was sent, and the arm holds.
        """

    @abstractmethod
    def start(self, request: Request) -> Ticket:
        """Start a slow request (tare, payload) without blocking; keep cycling and poll the ticket."""

    @abstractmethod
    def hold(self) -> None:
        """Stop the arm and keep it there. Callable at any time, any number of times; never raises."""

    @abstractmethod
    def close(self) -> None:
        """Hold, then release the device. Idempotent."""

    def snapshot(self) -> Snapshot | None:
        """Return the whole state of robot and world between two cycles, or None if it cannot be saved (any real
        device).

        A wrapper includes the snapshot of the wrapped robot, and returns None if that is None.

        Raises:
            BackendError: The device or simulator has failed.
        """
        return None

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of this robot, or of one opened with the same world, conditions, seed and options.

        The same commands then give bit-identical observations. Tickets given before stay as they were.

        Raises:
            BadInput: The snapshot is from another backend or version, or from a robot that was opened differently.
            BackendError: This robot keeps no snapshots.
        """
        raise BackendError(f"{type(self).__name__} cannot be restored to an earlier state")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.hold()
        self.close()


class Backend(ABC):
    """A factory of robots, registered as an entry point of the group `glotouch_bt.backends`."""

    name: str
    summary: str
    description: RobotDescription | None = None
    """The robot that it opens, apart from what the device itself reports; None if only an open robot can tell."""
    clock_waits: bool = False
    """True if no time passes on a robot's clock between two cycles, with any options. A run then starts before all
    modules are loaded; the first tick that needs one waits for it."""

    @abstractmethod
    def open(self, world: World, conditions: Conditions, seed: int, options: Mapping[str, object]) -> Robot:
        """Connect or build a robot that is ready for its first cycle.

        Args:
            world: The nominal world.
            conditions: Disturbances to apply (a hardware backend ignores them).
            seed: Every random draw of the robot and its world comes from this.
            options: Backend options: every `--set name=value` that is not a mission parameter.

        Raises:
            BadInput: The world cannot be built (objects that do not fit, unusable meshes, unknown options).
            BackendError: The device did not come up.
        """

    def describe(self, options: Mapping[str, object]) -> RobotDescription | None:
        """Return the robot that `open` would open with these options, without opening it; None as for `description`.

        Raises:
            BadInput: The options name a robot that cannot be read.
        """
        return self.description

    def is_portable(self, option: str, value: object) -> bool:
        """Return True if a run's folder, which may come from a stranger, may set this option when it is resumed.

        Return False (the default) for all that names a program, a file, an address or a device: the user must give it
        again.
        """
        return False

    def referee(self, robot: Robot) -> Referee | None:
        """Return access to the ground truth of `robot`'s world, for scoring only; None on hardware."""
        return None

    def disturber(self, robot: Robot) -> Disturber | None:
        """Return the interface through which faults change `robot`'s world; None on hardware."""
        return None

    def camera(self, robot: Robot) -> Callable[[int, int], Picture] | None:
        """Return a function that takes pictures of `robot`'s world, for a person to look at; None without a camera.

        It takes width and height in pixels and returns (height, width, 3) RGB. It raises `BackendError` where pictures
        cannot be drawn. Skills have no access to it.
        """
        return None

    def touch_sampler(self, world: World, conditions: Conditions, seed: int) -> TouchSampler | None:
        """Return touches of standing objects without a robot, for experiments; None if the backend offers none.

        Raises:
            BadInput: As `open`.
        """
        return None
