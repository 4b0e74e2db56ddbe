"""A world, both arms, and a loop that drives a motion on the fake robot."""

from __future__ import annotations

from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import Arm, Kinematics
from glotouch_bt.robot import Command, Container, Holder, Limits, ObjectSet, Observation, Pose, Probe, World
from glotouch_bt.robot.fake import FakeRobot


@pytest.fixture(scope="session")
def world() -> World:
    return World(
        name="test",
        container=Container(pose_B_K=Pose(np.array([0.6, 0.0, -0.2])), interior_m=(0.30, 0.40, 0.08)),
        probe=Probe(),
        holder=Holder(pose_B_grasp=Pose.pointing_down((0.45, -0.32, -0.06), np.pi)),
        objects=ObjectSet(folder=Path("unused")),
    )


@pytest.fixture(scope="session")
def kinematics() -> Kinematics:
    return Kinematics(RIZON4_XENSE)


@pytest.fixture
def arm(world: World) -> Arm:
    return Arm(RIZON4_XENSE, Limits(), world, 0.01)


@pytest.fixture
def robot() -> FakeRobot:
    return FakeRobot(RIZON4_XENSE)


Drive = Callable[[FakeRobot, Generator[Command, Observation, Any]], Any]


@pytest.fixture(scope="session")
def drive() -> Drive:
    def run(robot: FakeRobot, motion: Generator[Command, Observation, Any]) -> Any:
        try:
            command = next(motion)
            while True:
                command = motion.send(robot.cycle(command))
        except StopIteration as end:
            return end.value

    return run
