"""The conformance suite on the Flexiv/Xense backend: simulated devices behind the driver process, in lock-step."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Mapping

import pytest

from glotouch_backends.flexiv_xense.client.backend import FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.robot import FlexivXenseRobot
from glotouch_backends.flexiv_xense.driver.messages import RefereeAnswer, RefereeRequest
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.conformance import RobotConformance, Wall
from glotouch_bt.robot import Conditions, Robot
from tests.conformance.conformance_world import OPTIONS, WORLD, floor
from tests.support.forked_driver import fork_drivers


@pytest.fixture(autouse=True)
def forked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork the driver's process: a start from nothing, thirty times, would take most of these tests' time."""
    fork_drivers(monkeypatch.setattr)


def disturb(name: str) -> Callable[[Robot], None]:
    """Return a function that disturbs the simulated devices."""

    def do(robot: Robot) -> None:
        assert isinstance(robot, FlexivXenseRobot)
        link = robot.link
        link.ask(RefereeRequest(number=link.number(), method="disturb", name=name), RefereeAnswer)

    return do


def kill_driver(robot: Robot) -> None:
    assert isinstance(robot, FlexivXenseRobot)
    assert robot.process is not None
    os.kill(robot.process.pid, signal.SIGKILL)


class TestSimulatedDevices(RobotConformance):
    def make(self) -> Robot:
        return FlexivXenseBackend().open(WORLD, Conditions(), 0, {"devices": "simulated", **OPTIONS})

    def wall(self) -> Wall:
        return floor(RIZON4_XENSE)

    def losses(self) -> Mapping[str, Callable[[Robot], None]]:
        names = ("fault", "estop", "reduced", "link", "frozen")
        return {**{name: disturb(name) for name in names}, "the driver's process": kill_driver}
