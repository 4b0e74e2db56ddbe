"""What the parts of the conformance suite share: what a subclass says, and the robots they use."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import ClassVar

from glotouch_bt.conformance.rig import Rig, Wall
from glotouch_bt.robot import GlotouchError, Robot, Tare


class Conformance:
    """What is said about one robot; subclass `RobotConformance` and implement `make`.

    Attributes:
        sample_s: Time between two samples.
        paced: Time passes by the wall's clock: stamps jitter, and a period may be late now and then.
        track_m: How far P may be from its setpoint in a slow motion.
        rest_force_N, rest_torque_Nm: How large the mean tared wrench may be at rest, up to 20 degrees from where the
            sensor was tared (noise, drift, imperfect weight compensation).
        weight_share: How wrong the compensation of a payload may be.
        aperture_m: How wrong the reported aperture may be.
        pads: It has tactile pads.
        stop_s: From a hold to the arm braking.
        loss_s: From losing a device to an error.
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

    # --- what a subclass says ---------------------------------------------------------------------------------------

    def make(self) -> Robot:
        """A robot, ready, at its home posture with free space around; it is closed here."""
        raise NotImplementedError("say how a robot is made")

    def wall(self) -> Wall | None:
        """A wall whose place is known, in the world of `make`."""
        return None

    def losses(self) -> Mapping[str, Callable[[Robot], None]]:
        """Ways to lose a device or to give it a fault, by name."""
        return {}

    # --- robots -----------------------------------------------------------------------------------------------------

    @classmethod
    def teardown_class(cls) -> None:
        """Close the shared robot."""
        if cls._shared is not None:
            cls._shared.robot.close()
            cls._shared = None

    def rig(self) -> Rig:
        """The shared robot at home, at rest and tared; a new one if it has been broken."""
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
        """A robot of one's own, closed at the end. The shared one is closed first: there may be only one device."""
        self.teardown_class()
        robot = self.make()
        try:
            yield Rig(robot)
        finally:
            robot.close()
