"""Motions on the fake robot: straightness, limits, guards, refusals."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import Arc, Arm, Line, Polyline
from glotouch_bt.robot import Limits, MotionRefused, Observation, Pose, World
from glotouch_bt.robot.fake import FAKE_ARM, FakeRobot, SpringWall
from tests.support.outlines import disc

DT = 0.01


def start_at(arm: Arm, robot: FakeRobot, pose: Pose, drive) -> None:  # type: ignore[no-untyped-def]
    arm.sync(robot.observe())
    drive(robot, arm.joints(arm.kinematics.ik(pose, arm.q)))


@pytest.mark.parametrize("description", [RIZON4_XENSE, FAKE_ARM], ids=lambda d: d.name)
def test_lines_are_straight_and_smooth(description, world: World, drive) -> None:  # type: ignore[no-untyped-def]
    arm, robot = Arm(description, Limits(), world, DT), FakeRobot(description)
    arm.sync(robot.observe())
    begin = arm.pose_B_P
    speed, acceleration = 0.2, 1.0
    result = drive(robot, arm.shift((0.08, 0.15, -0.05), speed))
    assert result.completed
    assert result.stop is None
    way = np.array([0.08, 0.15, -0.05])
    assert result.travelled_m == pytest.approx(float(np.linalg.norm(way)))
    unit = way / np.linalg.norm(way)
    motions = [c.motion for c in robot.commands if c.motion is not None]
    track = np.stack([arm.kinematics.fk(m.q).position_m for m in motions])
    assert np.abs(np.cross(track - begin.position_m, unit)).max() < 1e-5
    for m in motions:
        pose = arm.kinematics.fk(m.q)
        assert np.linalg.norm(pose.position_m - m.pose_B_P.position_m) < 1e-5
        assert abs(float(pose.quat @ m.pose_B_P.quat)) > 1 - 1e-9
        # What is commanded as velocity is what moves P.
        twist = arm.kinematics.jacobian(m.q) @ m.dq
        assert np.linalg.norm(twist[:3] - unit * float(unit @ twist[:3])) < 1e-3
        assert np.linalg.norm(twist[:3]) <= speed + 1e-4
        assert np.linalg.norm(twist[3:]) < 1e-3
    q = np.stack([m.q for m in motions])
    dq, ddq = np.stack([m.dq for m in motions]), np.stack([m.ddq for m in motions])
    # Velocity and acceleration are the derivatives of the positions (central differences; O(dt^2 jerk)).
    np.testing.assert_allclose((q[2:] - q[:-2]) / (2 * DT), dq[1:-1], atol=3e-3)
    np.testing.assert_allclose((dq[2:] - dq[:-2]) / (2 * DT), ddq[1:-1], atol=0.15)
    steps = np.diff(np.vstack([begin.position_m, track]), axis=0) / DT
    assert np.linalg.norm(steps, axis=1).max() <= speed + 1e-4
    assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() / DT <= acceleration * 1.01
    np.testing.assert_array_equal(motions[-1].dq, 0.0)
    np.testing.assert_allclose(track[-1], begin.position_m + way, atol=1e-6)


def test_arc_keeps_its_radius_and_limits_centripetal_acceleration(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    start_at(arm, robot, Pose.pointing_down((0.6, 0.0, 0.0), np.pi), drive)
    centre = arm.pose_B_P.position_m + np.array([0.02, 0.0, 0.0])
    result = drive(robot, arm.arc(centre, (0, 0, 1), 2 * np.pi, 0.25))
    radius = np.hypot(*(result.path_B_m - centre)[:, :2].T)
    np.testing.assert_allclose(radius, 0.02, atol=1e-5)
    speeds = np.linalg.norm(np.diff(result.path_B_m, axis=0), axis=1) / DT
    assert speeds.max() <= np.sqrt(arm.limits.tcp_acceleration_m_s2 * 0.02) + 1e-4


def test_transit_goes_up_across_and_down(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    start_at(arm, robot, Pose.pointing_down((0.55, -0.1, -0.1), np.pi), drive)
    goal = Pose.pointing_down((0.65, 0.12, -0.12), np.pi / 2)
    result = drive(robot, arm.transit(goal, 0.02, 0.2))
    path = result.path_B_m
    moving = np.linalg.norm(path[:, :2] - path[0, :2], axis=1) > 1e-4
    there = np.linalg.norm(path[:, :2] - goal.position_m[:2], axis=1) < 1e-4
    across = moving & ~there
    assert across.any()
    np.testing.assert_allclose(path[across][:, 2], 0.02, atol=1e-4)
    np.testing.assert_allclose(arm.pose_B_P.position_m, goal.position_m, atol=1e-6)
    assert arm.pose_B_P.yaw_rad == pytest.approx(np.pi / 2, abs=1e-6)
    assert result.travelled_m == pytest.approx(0.12 + np.hypot(0.1, 0.22) + 0.14, abs=1e-4)


def test_free_motions_keep_the_posture_near_home(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    """Many closed loops: without a posture pull the pseudo-inverse drifts in the null space."""
    arm.sync(robot.observe())
    here = arm.pose_B_P
    corners = [
        Pose.pointing_down(here.position_m + d, np.pi + t) for d, t in (((0.1, 0.1, 0), 1.0), ((0, 0.15, 0.1), -1.0))
    ]
    for _ in range(5):
        drive(robot, arm.follow(Polyline((arm.pose_B_P, *corners, here)), 0.25, check=False))
    assert np.abs(arm.q - arm.kinematics.home).max() < 0.15


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(speed=st.floats(0.01, 0.12), gap=st.floats(0.0005, 0.06), acceleration=st.floats(0.2, 1.0))
def test_guarded_stop_stays_within_the_stop_distance(
    world: World, drive, speed: float, gap: float, acceleration: float
) -> None:  # type: ignore[no-untyped-def]
    """After the block that shows the contact, P travels at most v dt + v^2/2a + v a/2j, and a little while a0 falls."""
    arm = Arm(RIZON4_XENSE, Limits(), world, DT)
    begin = arm.pose_B_P
    ball = begin.apply((0.0, 0.0, 0.13))
    wall = SpringWall(ball + np.array([0.0, 0.006 + gap, 0.0]), np.array([0.0, -1.0, 0.0]), 500.0)
    robot = FakeRobot(RIZON4_XENSE, walls=[wall])
    arm.sync(robot.observe())
    seen: list[float] = []

    def guard(observation: Observation) -> str | None:
        if np.abs(observation.wrench_S[:, :3]).max() > 0.0:
            seen.append(float(observation.position_B_P[-1, 1]))
            return "touch"
        return None

    jerk = 20.0
    result = drive(robot, arm.shift((0, 0.06, 0), speed, guard=guard, acceleration_m_s2=acceleration, jerk_m_s3=jerk))
    if result.stop is None:
        assert result.completed
        return
    a, j = arm.limits.stop_acceleration_m_s2, arm.limits.stop_jerk_m_s3
    peak = speed + acceleration**2 / (2 * j)
    bound = peak * acceleration / j + peak**2 / (2 * a) + peak * a / (2 * j)
    rest = float(robot.observe().position_B_P[-1, 1])
    assert rest - seen[0] <= bound + 1e-6
    assert rest - begin.position_m[1] <= gap + speed * DT + bound + 1e-6
    assert result.stop == "touch"
    assert len(seen) == 1
    assert result.travelled_m == pytest.approx(rest - begin.position_m[1], abs=1e-5)
    np.testing.assert_array_equal(robot.commands[-1].motion.dq, 0.0)  # type: ignore[union-attr]
    # The very next command already brakes.
    trip = len(robot.commands) - 1
    v = [float((arm.kinematics.jacobian(c.motion.q) @ c.motion.dq)[1]) for c in robot.commands if c.motion]
    assert v[trip] == pytest.approx(0.0, abs=1e-9)


def test_guard_takes_effect_in_the_next_command(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    arm.sync(robot.observe())
    count = 0

    def guard(_: Observation) -> object | None:
        nonlocal count
        count += 1
        return "now" if count == 60 else None

    drive(robot, arm.shift((0, 0.1, 0), 0.06, guard=guard))
    speeds = [float((arm.kinematics.jacobian(c.motion.q) @ c.motion.dq)[1]) for c in robot.commands if c.motion]
    assert speeds[59] == pytest.approx(0.06, abs=1e-5)
    a, j = arm.limits.stop_acceleration_m_s2, arm.limits.stop_jerk_m_s3
    fall = a * (0.01 - 0.5 * a / j) if a / j < 0.01 else 0.5 * j * 0.01**2  # jerk-limited, over one period
    assert speeds[60] == pytest.approx(0.06 - fall, abs=1e-4)
    assert len(speeds) == 60 + 4  # v/a + a/j = 32 ms, rounded up to whole periods


def test_collision_is_refused_by_name_before_any_command(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    start_at(arm, robot, Pose.pointing_down((0.6, 0.0, -0.15), np.pi), drive)
    before = robot.cycles
    with pytest.raises(MotionRefused, match=r"shift refused: left finger would hit wall \+y of the container"):
        drive(robot, arm.shift((0.0, 0.25, 0.0), 0.1))
    with pytest.raises(MotionRefused, match=r"finger would hit floor of the container"):
        drive(robot, arm.shift((0.0, 0.0, -0.06), 0.1))
    arm.scene.add_obstacle("pillar", disc((0.0, 0.1), 0.03), height_m=0.07)
    with pytest.raises(MotionRefused, match=r"would hit pillar"):
        drive(robot, arm.shift((0.0, 0.1, 0.0), 0.1))
    assert robot.cycles == before


def test_limits_are_refused_by_name(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    arm.sync(robot.observe())
    here = arm.pose_B_P
    for motion, match in (
        (arm.shift((0, 0.1, 0), 0.3), "speed_m_s 0.3 is not within"),
        (arm.shift((0, 0.1, 0), 0.1, acceleration_m_s2=3.0), "acceleration_m_s2"),
        (arm.shift((0.9, 0.0, 0.0), 0.1), "cannot follow the path beyond|would leave its range|would turn at"),
        (
            arm.shift((-0.5, 0.0, -0.1), 0.1),
            "cannot follow the path beyond|would leave its range|would hit|would turn at",
        ),
        (arm.arc(here.position_m, (0, 0, 1), -4.0, 0.1, turn=True), "joint7 would leave its range"),
        (arm.follow(Line(Pose(here.position_m + 0.01, here.quat), here), 0.1), "begins 17.3 mm"),
        (arm.joints(np.full(7, 3.0)), "joint1 at 3.000 rad is outside its range"),
    ):
        with pytest.raises(MotionRefused, match=match):
            drive(robot, motion)
    assert robot.cycles == 0


def test_joint_move_keeps_the_tool_speed(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    arm.sync(robot.observe())
    goal = arm.kinematics.home + np.array([0.6, 0.3, 0.2, -0.3, 0.1, 0.2, 0.5])
    drive(robot, arm.joints(goal, 1.0))
    np.testing.assert_array_equal(arm.q, goal)
    track = np.stack([c.motion.pose_B_P.position_m for c in robot.commands if c.motion])
    speed = np.linalg.norm(np.diff(track, axis=0), axis=1) / DT
    assert 0.9 * arm.limits.tcp_speed_m_s < speed.max() <= arm.limits.tcp_speed_m_s
    drive(robot, arm.joints(goal))
    np.testing.assert_array_equal(arm.q, goal)


def test_jaws_close_on_a_width_and_report_it(arm: Arm, drive) -> None:  # type: ignore[no-untyped-def]
    robot = FakeRobot(RIZON4_XENSE, grip_width_m=0.031)
    arm.sync(robot.observe())
    state = drive(robot, arm.jaws(0.0, speed_m_s=0.05, force_N=8.0))
    assert state.aperture_m == pytest.approx(0.031)
    assert state.force_N == pytest.approx(8.0)
    assert not state.moving
    assert arm.aperture_m == pytest.approx(0.031)
    took = robot.cycles * DT
    assert 0.054 / 0.05 + 0.05 <= took <= 0.054 / 0.05 + 0.1
    again = robot.cycles
    state = drive(robot, arm.jaws(0.06))
    assert state.aperture_m == pytest.approx(0.06)
    drive(robot, arm.jaws(0.06))  # already there: still ends
    assert robot.cycles - again < 100
    assert drive(robot, arm.jaws(0.0, speed_m_s=0.001, timeout_s=0.3)).moving


def test_hold_counts_whole_periods(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    arm.sync(robot.observe())
    assert len(drive(robot, arm.hold(0.2))) == 20
    assert drive(robot, arm.hold(0.0)) == []
    frames = [o.tactile for o in drive(robot, arm.hold(0.2, tactile=True)) if o.tactile is not None]
    assert 11 <= len(frames) <= 13


def test_closing_a_motion_keeps_the_last_setpoint(arm: Arm, robot: FakeRobot) -> None:
    arm.sync(robot.observe())
    motion = arm.shift((0, 0.1, 0), 0.1)
    command = next(motion)
    for _ in range(30):
        command = motion.send(robot.cycle(command))
    motion.close()
    assert command.motion is not None
    np.testing.assert_array_equal(arm.q, command.motion.q)


def test_zero_length_path_ends_without_a_command(arm: Arm, robot: FakeRobot, drive) -> None:  # type: ignore[no-untyped-def]
    arm.sync(robot.observe())
    result = drive(robot, arm.shift((0, 0, 0), 0.1))
    assert result.completed
    assert robot.cycles == 0
    result = drive(robot, arm.follow(Arc(arm.pose_B_P, arm.pose_B_P.position_m, (0, 0, 1), 0.5, turn=True), 0.1))
    assert result.completed
    assert arm.pose_B_P.yaw_rad == pytest.approx(np.angle(np.exp(1j * (np.pi + 0.5))), abs=1e-6)


def test_motions_are_reproducible_to_the_bit(world: World, drive) -> None:  # type: ignore[no-untyped-def]
    records = []
    for _ in range(2):
        arm, robot = Arm(RIZON4_XENSE, Limits(), world, DT), FakeRobot(RIZON4_XENSE)
        arm.sync(robot.observe())
        drive(robot, arm.shift((0.05, 0.05, 0), 0.1))
        records.append(np.stack([c.motion.q for c in robot.commands if c.motion]).tobytes())
    assert records[0] == records[1]


def test_the_axes_of_a_sensor_that_is_turned_against_the_jaws(world: World) -> None:
    """Closed form: E = P turned back about z."""
    gripper = FAKE_ARM.gripper
    turned = dataclasses.replace(gripper, pose_E_P=gripper.pose_E_P @ Pose.planar((0.0, 0.0, 0.0), np.pi / 6))
    arm = Arm(dataclasses.replace(FAKE_ARM, gripper=turned), Limits(), world, DT)
    pose_B_E = arm.pose_B_P @ turned.pose_E_P.inverse()
    assert np.allclose(arm.rotation_B_S, pose_B_E.rotation)
    assert np.allclose(arm.rotation_P_S @ [0.0, 1.0, 0.0], [0.5, np.sqrt(0.75), 0.0])
