"""Robots of the MuJoCo backend: chosen by an option, built from their files alone."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.model.arm import add_arm
from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.robot import Conditions, ParamError, RobotDescription, UnknownName, World
from glotouch_bt.runs import robot_identity
from tests.backends.mujoco.conftest import LAYOUT

mujoco = pytest.importorskip("mujoco")
BACKEND = MujocoBackend()


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_a_robot_stands_at_its_home(name: str, world: World) -> None:
    with BACKEND.open(world, Conditions(), 0, {"layout": LAYOUT, "robot": name}) as robot:
        description = load_robot(name)
        assert robot.description.name == description.name == BACKEND.describe({"robot": name}).name
        np.testing.assert_allclose(robot.observe().q[-1], description.home_q, atol=1e-6)


def test_a_file_of_ones_own(world: World, tmp_path: Path) -> None:
    for suffix in (".yaml", ".urdf"):
        shutil.copy(shipped_robots()["iiwa14"].with_suffix(suffix), tmp_path)
    mine = tmp_path / "iiwa14.yaml"
    mine.write_text(mine.read_text().replace("robot: KUKA", "robot: MY"))
    with BACKEND.open(world, Conditions(), 0, {"layout": LAYOUT, "robot": str(mine)}) as robot:
        assert robot.description.name.startswith("MY")


def test_the_default_is_the_robot_of_the_description() -> None:
    assert robot_identity(BACKEND.describe({})) == robot_identity(BACKEND.description)


def test_an_unknown_robot(world: World) -> None:
    with pytest.raises(UnknownName, match="rizon4"):
        BACKEND.open(world, Conditions(), 0, {"robot": "rizon5"})


def test_a_runs_folder_chooses_shipped_robots_only() -> None:
    assert BACKEND.is_portable("robot", "iiwa14")
    assert not BACKEND.is_portable("robot", "/somewhere/arm.yaml")


def _renamed(description: RobotDescription, link: str) -> RobotDescription:
    first, *rest = description.joints
    return replace(description, joints=(replace(first, link=replace(first.link, name=link)), *rest))


def _soft(description: RobotDescription) -> RobotDescription:
    first, *rest = description.joints
    return replace(description, joints=(replace(first, servo_stiffness_Nm_rad=0.0), *rest))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_soft, "joint1.servo_stiffness_Nm_rad = 0.0: must be positive"),
        (lambda d: _renamed(d, "hand"), "'hand': must be another one"),
        (lambda d: _renamed(d, "object3"), "'object3': must be another one"),
    ],
)
def test_what_cannot_be_simulated(change: Callable[[RobotDescription], RobotDescription], said: str) -> None:
    with pytest.raises(ParamError) as caught:
        add_arm(mujoco.MjSpec(), change(load_robot("iiwa14")), np.zeros((7, 3)))
    assert said in str(caught.value)
