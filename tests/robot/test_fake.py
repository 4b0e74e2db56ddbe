"""The fake robot against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from glotouch_bt.robot import Command, GripperTarget, JointSetpoint, ParamError, Pose, SafetyStop, Tare, load_backend
from glotouch_bt.robot.fake import FAKE_ARM, FakeBackend, FakeRobot, SpringWall, forward

HOME = np.array(FAKE_ARM.home_q)


def setpoint(pose: Pose, q: np.ndarray = HOME) -> Command:
    return Command(JointSetpoint(q, np.zeros(7), np.zeros(7), pose))


def test_forward_kinematics_of_the_home_posture() -> None:
    pose = forward(FAKE_ARM, HOME)
    np.testing.assert_allclose(pose.position_m, [0.6, 0.0, 0.1], atol=1e-12)
    np.testing.assert_allclose(pose.rotation, Pose.pointing_down((0, 0, 0), np.pi).rotation, atol=1e-12)


def test_spring_wall_force_closed_form() -> None:
    """Ball of 6 mm at 0.13 m below P pressed into a 1 kN/m wall: force, direction and torque at the flange, by hand."""
    start = forward(FAKE_ARM, HOME)
    face = start.position_m[1] + 0.006 + 0.001
    wall = SpringWall(np.array([0.0, face, 0.0]), np.array([0.0, -2.0, 0.0]), 1000.0)
    robot = FakeRobot(walls=[wall])
    observation = robot.cycle(setpoint(Pose(start.position_m + np.array([0.0, 0.005, 0.0]), start.quat)))
    moved = np.arange(1, 11) / 10 * 0.005
    depth = np.maximum(moved - 0.001, 0.0)
    # Hand down with x_P along -x_B: y_S = y_B. The lever from S to the ball is 0.33 m along z_S.
    np.testing.assert_allclose(observation.wrench_S[:, 1], -1000.0 * depth, atol=1e-9)
    np.testing.assert_allclose(observation.wrench_S[:, 3], 0.33 * 1000.0 * depth, atol=1e-9)
    np.testing.assert_allclose(observation.wrench_S[:, [0, 2, 4, 5]], 0.0, atol=1e-9)
    assert robot.peak_force_N == pytest.approx(4.0)


def test_samples_are_evenly_spaced_in_time_and_position() -> None:
    robot = FakeRobot()
    start = robot.observe().pose_B_P
    first = robot.cycle(setpoint(Pose(start.position_m + np.array([0.01, 0.0, 0.0]), start.quat)))
    second = robot.cycle(Command())
    stamps = np.concatenate([first.stamp_s, second.stamp_s])
    np.testing.assert_allclose(np.diff(stamps), 0.001, atol=1e-12)
    np.testing.assert_allclose(first.position_B_P[:, 0] - start.position_m[0], np.arange(1, 11) * 1e-3, atol=1e-12)
    np.testing.assert_allclose(second.position_B_P, np.tile(first.position_B_P[-1], (10, 1)), atol=1e-15)
    assert robot.cycles == 2


def test_orientation_turns_evenly() -> None:
    robot = FakeRobot()
    start = robot.observe().pose_B_P
    observation = robot.cycle(setpoint(Pose(start.position_m, -Pose.pointing_down((0, 0, 0), np.pi + 0.02).quat)))
    np.testing.assert_allclose(np.linalg.norm(observation.quat_B_P, axis=1), 1.0, atol=1e-12)
    yaws = [Pose(np.zeros(3), q).yaw_rad % (2 * np.pi) - np.pi for q in observation.quat_B_P]
    np.testing.assert_allclose(yaws, np.arange(1, 11) * 0.002, atol=1e-6)


def test_tare_takes_its_duration_and_subtracts_the_mean() -> None:
    weight = np.array([0.0, 0.0, 5.0, 0.1, 0.0, 0.0])
    robot = FakeRobot(wrench=lambda t, p, q: np.tile(weight, (len(t), 1)))
    np.testing.assert_allclose(robot.cycle(Command()).wrench_S[-1], weight)
    ticket = robot.start(Tare(0.05))
    for _ in range(5):
        assert not ticket.done
        robot.cycle(Command())
    assert ticket.done
    assert ticket.error is None
    np.testing.assert_allclose(robot.cycle(Command()).wrench_S, 0.0, atol=1e-12)


def test_hard_limit_stops_permanently() -> None:
    robot = FakeRobot(wrench=lambda t, p, q: np.where(t[:, None] > 0.025, 40.0, 0.0) * np.eye(6)[2])
    robot.cycle(Command())
    robot.cycle(Command())
    with pytest.raises(SafetyStop, match="force_N 40 passed its hard limit 30") as caught:
        robot.cycle(Command())
    assert caught.value.stamp_s == pytest.approx(0.026)
    with pytest.raises(SafetyStop):
        robot.cycle(Command())
    robot.hold()


def test_commands_outside_the_limits_are_refused() -> None:
    robot = FakeRobot()
    pose = robot.observe().pose_B_P
    for q in (np.full(7, np.nan), np.full(7, 2.9), np.zeros(6)):
        with pytest.raises(ParamError):
            robot.cycle(setpoint(pose, q))
    assert robot.cycles == 0


def test_jaws_keep_their_speed_and_stop_at_a_rigid_width() -> None:
    robot = FakeRobot(grip_width_m=0.04)
    first = robot.cycle(Command(gripper=GripperTarget(0.0, 0.1, 7.0))).gripper
    assert first.aperture_m == pytest.approx(0.085 - 0.001)
    assert first.moving
    states = [robot.cycle(Command()).gripper for _ in range(60)]
    assert states[-1].aperture_m == pytest.approx(0.04)
    assert (states[-1].force_N, states[-1].moving) == (7.0, False)
    assert robot.cycle(Command(gripper=GripperTarget(0.06, 0.1, 7.0))).gripper.force_N == 0.0


def test_flat_frames_arrive_at_their_rate() -> None:
    robot = FakeRobot()
    frames = [robot.cycle(Command(tactile=True)).tactile for _ in range(100)]
    got = [f for f in frames if f is not None]
    assert 59 <= len(got) <= 61
    assert got[0].left_m.shape == FAKE_ARM.gripper.pad_shape
    assert not got[0].left_m.any()
    assert robot.cycle(Command()).tactile is None


def test_entry_point_gives_the_fake_backend() -> None:
    assert isinstance(load_backend("fake"), FakeBackend)
