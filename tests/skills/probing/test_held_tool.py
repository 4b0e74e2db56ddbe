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
    tool = HeldTool(np.array([dx, dy, 0.13]), 0.006, 0.016, yaw)
    pose = tool.pose_B_P(world, np.array([x, y, z]))
    np.testing.assert_allclose(tool.tip_K_m(world, pose), [x, y, z], atol=1e-12)
    np.testing.assert_allclose(pose.rotation[:, 2], [0, 0, -1], atol=1e-12)
    assert np.cos(pose.yaw_rad - yaw) == pytest.approx(1.0)


@given(yaw=angle, turn=angle, about=st.floats(0.0, 3e-3), across=st.floats(0.0, 6e-4), bearing=angle)
def test_the_deflection_is_compliance_times_force(world, yaw, turn, about, across, bearing) -> None:
    """In the hand's axes, whatever its yaw and the container's; a vertical force deflects nothing."""
    turned = Container(pose_B_K=Pose.planar((0.6, 0.1, -0.2), turn), interior_m=(0.3, 0.4, 0.08))
    world = dataclasses.replace(world, container=turned)
    tool = HeldTool(np.zeros(3), 0.006, 0.016, yaw, compliance_P_m_N=np.array([about, across]))
    pose = tool.pose_B_P(world, np.zeros(3))
    force_P = 2.0 * np.array([np.cos(bearing), np.sin(bearing), 0.7])
    in_K = turned.pose_B_K.rotation.T @ pose.rotation
    found = tool.deflection_K_m(world, pose, in_K @ force_P)
    np.testing.assert_allclose(in_K.T @ found, [about * force_P[0], across * force_P[1], 0.0], atol=1e-12)


def test_an_unmeasured_tool_is_believed_to_give_a_little(world) -> None:
    tool = HeldTool(np.zeros(3), 0.006, 0.016, 0.4)
    given_way = tool.deflection_K_m(world, tool.pose_B_P(world, np.zeros(3)), np.array([3.0, 4.0, 5.0]))
    np.testing.assert_allclose(given_way, [6e-4, 8e-4, 0.0], atol=1e-12)


def test_a_straight_probe_hangs_below_the_hand(world) -> None:
    tool = HeldTool(np.array([0.0, 0.0, 0.13]), 0.006, 0.016, 0.4)
    pose = tool.pose_B_P(world, np.array([0.02, -0.03, 0.01]))
    np.testing.assert_allclose(pose.position_m, [0.62, -0.03, -0.2 + 0.01 + 0.13], atol=1e-12)
