"""Where the ball is for a hand, and where the hand is for a ball: one is the inverse of the other."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.robot import Container, Pose
from glotouch_bt.skill.probing.held_tool import HeldTool

angle = st.floats(-np.pi, np.pi)
length = st.floats(-0.3, 0.3)


@given(x=length, y=length, z=length, yaw=angle, turn=angle, dx=st.floats(-0.01, 0.01), dy=st.floats(-0.01, 0.01))
def test_pose_is_the_inverse_of_tip(world, x, y, z, yaw, turn, dx, dy) -> None:
    turned = Container(pose_B_K=Pose.planar((0.6, 0.1, -0.2), turn), interior_m=(0.3, 0.4, 0.08))
    world = dataclasses.replace(world, container=turned)
    tool = HeldTool(np.array([dx, dy, 0.13]), 0.006, 0.004, 0.016, yaw)
    pose = tool.pose_B_P(world, np.array([x, y, z]))
    np.testing.assert_allclose(tool.tip_K_m(world, pose), [x, y, z], atol=1e-12)
    np.testing.assert_allclose(pose.rotation[:, 2], [0, 0, -1], atol=1e-12)
    assert np.cos(pose.yaw_rad - yaw) == pytest.approx(1.0)


def test_a_straight_probe_hangs_below_the_hand(world) -> None:
    tool = HeldTool(np.array([0.0, 0.0, 0.13]), 0.006, 0.004, 0.016, 0.4)
    pose = tool.pose_B_P(world, np.array([0.02, -0.03, 0.01]))
    np.testing.assert_allclose(pose.position_m, [0.62, -0.03, -0.2 + 0.01 + 0.13], atol=1e-12)
