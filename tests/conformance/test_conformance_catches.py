"""The suite finds each of five deliberately broken backends; the unbroken one passes the same tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.conformance import RobotConformance, Wall
from glotouch_bt.robot import Conditions, Robot, SafetyStop
from tests.conformance.broken import Break, Degrees, DroppedSamples, LateStop, SwallowedFault, Wrapped, WrongSign
from tests.conformance.conformance_world import OPTIONS, WORLD, floor


def blow_up(robot: Robot) -> None:
    assert isinstance(robot, Wrapped)
    assert isinstance(robot.inner, MujocoRobot)
    robot.inner.data.qvel[0] = np.nan


class Suite(RobotConformance):
    """The suite on a backend that is broken by `break_it`."""

    break_it: Break

    def make(self) -> Robot:
        return type(self).break_it(MujocoBackend().open(WORLD, Conditions(), 0, OPTIONS))

    def wall(self) -> Wall:
        return floor(RIZON4_XENSE)

    def losses(self) -> Mapping[str, Callable[[Robot], None]]:
        return {"the simulation": blow_up}


@contextmanager
def suite(break_it: Break) -> Iterator[Suite]:
    made = type("Broken", (Suite,), {"break_it": staticmethod(break_it), "_shared": None})
    try:
        yield made()
    finally:
        made.teardown_class()


FOUND_BY = {
    WrongSign: ("sign_and_frame_of_the_wrench", (0.3,)),
    DroppedSamples: ("blocks_are_complete_and_in_order", ()),
    LateStop: ("stops_without_a_motion_command", ()),
    Degrees: ("joints_and_pose_agree", ()),
    SwallowedFault: ("a_lost_device_is_an_error", ()),
}


@pytest.mark.parametrize("broken", FOUND_BY, ids=lambda b: b.__name__)
def test_a_broken_backend_fails(broken: Break) -> None:
    name, arguments = FOUND_BY[broken]  # type: ignore[index]
    with suite(broken) as bad, pytest.raises(AssertionError):
        getattr(bad, f"test_{name}")(*arguments)


@pytest.mark.parametrize("broken", FOUND_BY, ids=lambda b: b.__name__)
def test_the_same_backend_unbroken_passes(broken: Break) -> None:
    name, arguments = FOUND_BY[broken]  # type: ignore[index]
    with suite(Wrapped) as good:
        getattr(good, f"test_{name}")(*arguments)


@pytest.mark.parametrize(
    ("broken", "also"),
    [
        (WrongSign, "a_guarded_move_stops_at_a_wall"),
        (LateStop, "stops_on_hold"),
        (LateStop, "holds_after_a_refused_command"),
        (SwallowedFault, "the_hard_limit_stops_the_arm"),
    ],
    ids=lambda v: getattr(v, "__name__", v),
)
def test_other_tests_fail_as_well(broken: Break, also: str) -> None:
    """A hand that does not feel the wall runs into it until the robot stops itself."""
    with suite(broken) as bad, pytest.raises((AssertionError, pytest.fail.Exception, SafetyStop)):
        getattr(bad, f"test_{also}")()
