"""The conformance suite on the MuJoCo backend."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.conformance import RobotConformance, Wall
from glotouch_bt.robot import Conditions, Robot
from tests.conformance.conformance_world import OPTIONS, WORLD, floor

pytestmark = pytest.mark.slow


def blow_up(robot: Robot) -> None:
    assert isinstance(robot, MujocoRobot)
    robot.data.qvel[0] = np.nan


class TestMujoco(RobotConformance):
    def make(self) -> Robot:
        return MujocoBackend().open(WORLD, Conditions(), 0, OPTIONS)

    def wall(self) -> Wall:
        return floor(RIZON4_XENSE)

    def losses(self) -> Mapping[str, Callable[[Robot], None]]:
        return {"the simulation": blow_up}
