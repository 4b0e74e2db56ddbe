"""The open hand: its yaw, its room, and going down until something is met."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.motion import hand_pose_B, yaw_near_home
from glotouch_bt.robot import MotionRefused, Pose
from glotouch_skills.common.hand.clearance_rules import keeping_clear_of
from glotouch_skills.common.hand.hand import BUMP_N, NoSpace, glide, require_clear


@pytest.mark.parametrize("yaw", np.linspace(-7.0, 7.0, 29))
def test_an_easy_yaw_is_the_same_line_within_a_quarter_turn_of_home(bench, yaw: float) -> None:
    arm = bench().arm
    home = arm.kinematics.fk(arm.kinematics.home).yaw_rad
    easy = yaw_near_home(arm, yaw)
    assert abs(easy - home) <= 0.5 * np.pi + 1e-9
    assert np.sin(easy - yaw) == pytest.approx(0.0, abs=1e-9)  # whole half turns apart


def test_the_hand_points_down_at_the_place(bench) -> None:
    b = bench()
    pose = hand_pose_B(b.arm, b.world.container, np.array([0.02, 0.05, 0.03]), 0.4)
    np.testing.assert_allclose(pose.position_m, [0.62, 0.05, -0.17], atol=1e-12)
    np.testing.assert_allclose(pose.rotation[:, 2], [0, 0, -1], atol=1e-12)
    assert abs(pose.rotation[:, 0] @ [np.cos(0.4), np.sin(0.4), 0]) == pytest.approx(1.0)


def test_no_room_is_said_with_the_pair(bench, found) -> None:
    b = bench()
    pose = hand_pose_B(b.arm, b.world.container, np.array([0.0, 0.0, 0.03]), 0.0)
    require_clear(b.arm, pose, 0.06)
    with keeping_clear_of(b.arm, (found.round((0.0, 0.04), 0.02, index=3),)):
        assert "candidate 3" in b.arm.scene.obstacles
        with pytest.raises(NoSpace, match=r"finger would .* candidate 3"):
            require_clear(b.arm, pose, 0.06)
    require_clear(b.arm, pose, 0.06)
    with pytest.raises(MotionRefused):
        require_clear(b.arm, Pose.pointing_down((3.0, 0.0, 0.0), 0.0), 0.06)


def test_what_more_space_in_the_box_would_not_help_is_refused_otherwise(bench, found) -> None:
    """Beside a wall or a neighbour only space is lacking; through the floor, nothing in the box need be moved."""
    b = bench()
    beside_wall, too_low = np.array([0.0, 0.165, 0.03]), np.array([0.0, 0.0, 0.005])
    with pytest.raises(NoSpace, match="wall"):
        require_clear(b.arm, hand_pose_B(b.arm, b.world.container, beside_wall, 0.0), 0.06)
    beside = (found.round((0.0, 0.04), 0.02, index=3),)
    with keeping_clear_of(b.arm, beside), pytest.raises(MotionRefused) as refused:
        require_clear(b.arm, hand_pose_B(b.arm, b.world.container, too_low, 0.0), 0.06)
    assert not isinstance(refused.value, NoSpace)


def test_gliding_down_stops_on_what_stands_there(bench, things) -> None:
    """The fingertips (not the probe's ball) are what the fake feels with here."""
    top = 0.05
    tips = 0.016
    b = bench(things=[things.floor(top + 0.006)], tip_P_m=tips + 0.006)  # a ball whose far end is one radius below
    b.go(b.arm.shift((0.0, 0.0, -0.17), 0.2))
    start = b.arm.pose_B_P
    goal = Pose(start.position_m - [0.0, 0.0, 0.08], start.quat)
    assert b.go(glide(b.context, goal, 0.02)) is False
    ball_bottom = float(b.arm.pose_B_P.position_m[2]) + 0.2 - tips - 0.012
    depth = top + 0.006 - ball_bottom
    assert 0.0 < depth < 0.003
    assert b.robot.peak_force_N < 3 * BUMP_N
    free = bench()
    free.go(free.arm.shift((0.0, 0.0, -0.17), 0.2))
    assert free.go(glide(free.context, goal, 0.04)) is True
    assert free.go(glide(free.context, goal, 0.04)) is True  # already there
