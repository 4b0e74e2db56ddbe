"""Settings of the suite and the robots that its tests use."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import ClassVar

from glotouch_bt.conformance.rig import Rig, Wall
from glotouch_bt.robot import GlotouchError, Robot, Tare


class Conformance:
    """Expected properties of one robot; subclass `RobotConformance` and implement `make`.

    Attributes:
        sample_s: Time between two samples.
        paced: True if the robot's clock runs with wall time: stamps jitter, and a period may be late now and then.
        track_m: Largest distance of P from its setpoint in a slow motion.
        rest_force_N, rest_torque_Nm: Largest mean tared wrench at rest, up to 20 degrees from the orientation of the
            tare (noise, drift, imperfect weight compensation).
        weight_share: Relative error of the payload compensation.
        aperture_m: Largest error of the reported aperture.
        pads: True if the robot has tactile pads.
        stop_s: Longest time from a hold until the arm brakes.
        loss_s: Longest time from losing a device to an error.
    """

    sample_s: ClassVar[float] = 0.001
    paced: ClassVar[bool] = False
    track_m: ClassVar[float] = 0.002
    rest_force_N: ClassVar[float] = 0.5
    rest_torque_Nm: ClassVar[float] = 0.1
    weight_share: ClassVar[float] = 0.1
    aperture_m: ClassVar[float] = 0.0015
    pads: ClassVar[bool] = True
    stop_s: ClassVar[float] = 0.03
    loss_s: ClassVar[float] = 1.0
    _shared: ClassVar[Rig | None] = None

    # --- set by a subclass ------------------------------------------------------------------------------------------

    def make(self) -> Robot:
        """Return a robot at its home posture, ready and in free space. The suite closes it."""
        raise NotImplementedError("implement `make`: open and return the robot")

    def wall(self) -> Wall | None:
        """Return a wall at a known place in the world of `make`, or None."""
        return None

    def losses(self) -> Mapping[str, Callable[[Robot], None]]:
        """Return functions that lose a device or give it a fault, by name."""
        return {}

    # --- robots -----------------------------------------------------------------------------------------------------

    @classmethod
    def teardown_class(cls) -> None:
        """Close the shared robot."""
        if cls._shared is not None:
            cls._shared.robot.close()
            cls._shared = None

    def rig(self) -> Rig:
        """Return the shared robot at home, at rest and tared; open a new one if it is broken."""
        cls = type(self)
        if cls._shared is not None:
            try:
                self._home(cls._shared)
            except (GlotouchError, AssertionError):
                self.teardown_class()
        if cls._shared is None:
            cls._shared = Rig(self.make())
            cls._shared.ask(Tare())
        return cls._shared

    def _home(self, rig: Rig) -> None:
        rig.rest(0.2)
        rig.go(rig.kinematics.fk(rig.kinematics.home), 0.15)
        rig.rest(0.2)

    @contextmanager
    def own(self) -> Iterator[Rig]:
        """Open a robot for one test and close it at the end. The shared robot is closed first."""
        self.teardown_class()
        robot = self.make()
        try:
            yield Rig(robot)
        finally:
            robot.close()
