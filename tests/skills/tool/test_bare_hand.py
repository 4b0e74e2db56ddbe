"""The bare hand as a tool: its section is the fingers' outline."""

from __future__ import annotations

import numpy as np
import pytest
from py_trees.common import Status

from glotouch_backends.rizon4 import XENSE_GRIPPER
from glotouch_bt.motion.shapes import finger_outline_half_m
from glotouch_bt.robot import Pose
from glotouch_skills.tool.bare_hand import BareHand


def test_the_outline_follows_the_aperture() -> None:
    """Fingers of 22 x 14 mm each, closed and 10 mm open."""
    assert finger_outline_half_m(XENSE_GRIPPER, 0.0) == pytest.approx([0.011, 0.014])
    assert finger_outline_half_m(XENSE_GRIPPER, 0.010) == pytest.approx([0.011, 0.019])


def test_the_hand_is_a_tool(bench) -> None:
    b = bench()
    skill = b.make(BareHand)
    b.run(skill)
    assert skill.status is Status.SUCCESS, skill.feedback_message
    tool = skill.tool
    assert not tool.round
    assert tool.tip_P_m == pytest.approx([0.0, 0.0, XENSE_GRIPPER.fingertip_below_P_m])
    assert tool.aperture_m == pytest.approx(0.0, abs=1e-3)
    assert np.cos(tool.yaw_B_rad - b.arm.pose_B_P.yaw_rad) == pytest.approx(1.0, abs=1e-8)
    # Against a face straight ahead of x_P the point lies half a finger's width ahead.
    hand = Pose.pointing_down((0.6, 0.0, 0.0), tool.yaw_B_rad)
    ahead = hand.rotation[:, 0]
    point = tool.contact_point_K_m(b.world, hand, ahead, -ahead)
    assert point == pytest.approx(0.011 * ahead[:2], abs=1e-9)


def test_bare_hand__probe_held(bench) -> None:
    b = bench()
    b.arm.scene.hold_tool(True)
    skill = b.make(BareHand)
    b.run(skill)
    assert (skill.status, skill.reason.code) == (Status.FAILURE, "probe_held")


def test_broken_off_anywhere(bench, preempt_all_along) -> None:
    def make():
        b = bench()
        return b, b.make(BareHand)

    preempt_all_along(make, 5)
