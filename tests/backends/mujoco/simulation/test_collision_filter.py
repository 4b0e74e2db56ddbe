"""Objects at rest are left out of the collision detection only where that changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.robot import HOLD, Conditions, World

Drive = Callable[[MujocoRobot], Any]
FAR = {"block": (0.10, 0.15, 0.0)}
NEAR = {"block": (0.03, 0.08, 0.0)}


def open_with(world: World, layout: dict[str, tuple[float, float, float]]) -> MujocoRobot:
    robot = MujocoBackend().open(world, Conditions(), 0, {"layout": layout, "trace": "true"})
    assert isinstance(robot, MujocoRobot)
    return robot


def left_out(robot: MujocoRobot) -> bool:
    """Return True if the next period leaves the object out."""
    body = robot.handles.object_bodies[0]
    with robot._filter:
        return not robot.model.body_contype[body] and not robot.model.body_conaffinity[body]


def test_a_resting_object_is_left_out_within_a_period_only(world: World) -> None:
    with open_with(world, FAR) as robot:
        before = robot.model.body_contype.copy(), robot.model.body_conaffinity.copy()
        for _ in range(3):
            robot.cycle(HOLD)
        assert left_out(robot)
        np.testing.assert_array_equal(robot.model.body_contype, before[0])
        np.testing.assert_array_equal(robot.model.body_conaffinity, before[1])


@pytest.mark.parametrize("change", ["place", "speed", "force"])
def test_an_object_that_a_fault_moves_is_taken_in_at_once(world: World, change: str) -> None:
    with open_with(world, FAR) as robot:
        for _ in range(3):
            robot.cycle(HOLD)
        body = robot.handles.object_bodies[0]
        joint = int(robot.model.body_jntadr[body])
        if change == "place":
            robot.data.qpos[int(robot.model.jnt_qposadr[joint]) + 2] += 0.01
        elif change == "speed":
            robot.data.qvel[int(robot.model.jnt_dofadr[joint])] = 0.1
        else:
            robot.data.xfrc_applied[body, 0] = 1.0
        assert not left_out(robot)


def test_an_object_near_the_hand_is_not_left_out(world: World, drive: Drive) -> None:
    """Pads stand far beside the block, then near it; the replay, which leaves nothing out, ends in the same state."""
    with open_with(world, NEAR) as robot:
        driver = drive(robot)
        driver.jaws(0.070, force_N=20.0, time_s=0.2)
        driver.line((0.63, 0.08, -0.10), speed_m_s=0.2)
        driver.line((0.63, 0.08, -0.165), speed_m_s=0.1)
        seen = [left_out(robot)]
        driver.jaws(0.044, force_N=10.0, time_s=0.5)
        seen.append(left_out(robot))
        driver.jaws(0.020, force_N=10.0, time_s=0.5)
        assert seen == [True, False]
        assert robot.trace is not None
        assert robot.trace.replay(robot.data).same_end_state
