"""The reach of an arm over the container and the stand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from glotouch_backends.robots import load_robot, shipped_robots
from glotouch_bt.motion import out_of_reach
from glotouch_bt.robot import Pose, World

ROBOTS = sorted(shipped_robots())


@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_arms_reach_the_shipped_world(name: str, world: World) -> None:
    assert out_of_reach(load_robot(name), world) == []


@pytest.mark.parametrize("name", ROBOTS)
def test_a_container_too_far_away_is_named_with_its_corner(name: str, world: World) -> None:
    far = replace(world, container=replace(world.container, pose_B_K=Pose.planar((0.85, 0.0, -0.2), 0.0)))
    found = out_of_reach(load_robot(name), far)
    assert found
    assert all("the corner +x" in fault and "cannot be reached" in fault for fault in found)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_stand_too_far_away(name: str, world: World) -> None:
    holder = replace(world.holder, pose_B_grasp=Pose.pointing_down((0.45, -1.2, -0.06), 0.0))
    (fault,) = out_of_reach(load_robot(name), replace(world, holder=holder))
    assert fault.startswith("the probe in its stand: ")
