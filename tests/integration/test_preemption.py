"""Breaking off with real dynamics: the arm brakes, the probe is not dropped, and the next skill takes over smoothly."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_backends.mujoco import MujocoBackend
from glotouch_bt.mission.read.worlds import load_world
from glotouch_bt.robot import HOLD, Conditions
from glotouch_skills.tool.tool_pickup import ToolPickup
from glotouch_skills.tool.tool_return import ToolReturn


@pytest.fixture
def simulated(bench):
    """A bench on MuJoCo with one shipped object, ideal conditions."""
    world = load_world("container_five")
    world = dataclasses.replace(world, objects=dataclasses.replace(world.objects, names=("apple",)))
    backend = MujocoBackend()
    robot = backend.open(world, Conditions(), 0, {})
    made = bench().on(world, robot)
    yield made, backend.referee(robot)
    robot.close()


def break_off(b, skill) -> float:
    """Break off in mid-tick with no time until the next skill; how fast the joints were, rad/s."""
    b.context.command = HOLD
    skill.tick_once()
    assert skill.status is Status.RUNNING
    skill.stop(Status.INVALID)
    assert b.context.command is HOLD
    assert not b.arm.scene._allowed
    speed = float(np.abs(b.context.observation.dq[-1]).max())
    b.pass_time(b.context.command)
    return speed


def tip_height(b, referee) -> float:
    return float(referee.tip_B_m()[2] - b.world.container.pose_B_K.position_m[2])


def test_the_probe_is_kept_from_the_holder_and_back_whatever_is_broken_off(simulated) -> None:
    b, referee = simulated
    skill = b.make(ToolPickup)
    fastest = []
    # On the way to the holder, at full speed, and again soon after.
    b.run(skill, 60)
    fastest.append(break_off(b, skill))
    b.run(skill, 40)
    fastest.append(break_off(b, skill))
    assert max(fastest) > 0.2, "it was broken off in motion"
    # With the probe on its way up.
    while tip_height(b, referee) < 0.06:
        assert b.tick(skill) is Status.RUNNING
    break_off(b, skill)
    b.run(skill, 30)
    assert tip_height(b, referee) > 0.05, "the probe is still in the hand"
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    assert skill.tool.floor_z_K_m == pytest.approx(0.0, abs=0.0015)
    # Back into the holder, broken off over it and inside it.
    back = b.make(ToolReturn, inputs={"tool": skill.tool})
    b.run(back, 150)
    break_off(b, back)
    stowed = b.world.holder.pose_B_grasp.position_m
    while (
        float(b.arm.pose_B_P.position_m[2]) > stowed[2] + 0.05 or abs(b.arm.pose_B_P.position_m[1] - stowed[1]) > 0.01
    ):
        assert b.tick(back) is Status.RUNNING, back.feedback_message
    break_off(b, back)
    b.run(back)
    assert back.status is Status.SUCCESS, back.feedback_message
    assert referee.probe_in_holder()
    assert referee.peak_force_N() < b.robot.limits.hard_force_N
