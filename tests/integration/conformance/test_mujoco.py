"""The conformance suite on the MuJoCo backend."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.robots import load_robot
from glotouch_bt.conformance import RobotConformance, Wall
from glotouch_bt.robot import Conditions, Robot
from tests.conformance.conformance_world import OPTIONS, WORLD, floor


def blow_up(robot: Robot) -> None:
    assert isinstance(robot, MujocoRobot)
    robot.data.qvel[0] = np.nan


class _OnMujoco(RobotConformance):
    robot: ClassVar[str]

    def make(self) -> Robot:
        return MujocoBackend().open(WORLD, Conditions(), 0, {**OPTIONS, "robot": self.robot})

    def wall(self) -> Wall:
        return floor(load_robot(self.robot))

    def losses(self) -> Mapping[str, Callable[[Robot], None]]:
        return {"the simulation": blow_up}


class TestRizon4(_OnMujoco):
    robot = "rizon4"


class TestIiwa14(_OnMujoco):
    robot = "iiwa14"
