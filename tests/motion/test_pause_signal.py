"""Pauses keep the path, the limits and the guard of a motion, however often and whenever they come."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from glotouch_bt.motion import Arm, Kinematics, MoveResult
from glotouch_bt.motion.pause_signal import RETREAT_M
from glotouch_bt.robot import Array, Command, Observation
from glotouch_bt.robot.fake import FakeRobot, SpringWall

DT = 0.01
QUIET = settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))


def play(
    arm: Arm, robot: FakeRobot, motion: Generator[Command, Observation, Any], wanted: Callable[[int], bool]
) -> tuple[Any, list[Command]]:
    """Drive a motion; request a pause in the cycles for which `wanted` is true."""
    commands: list[Command] = []
    try:
        command = next(motion)
        while True:
            commands.append(command)
            seen = robot.cycle(command)
            arm.pause_signal.requested = wanted(len(commands))
            command = motion.send(seen)
    except StopIteration as end:
        return end.value, commands


def track(arm: Arm, commands: list[Command]) -> Array:
    """Return the commanded positions (n, 3) of P; during a hold the last one."""
    out, q = [], None
    for command in commands:
        q = command.motion.q if command.motion is not None else q
        out.append(arm.kinematics.fk(q).position_m)
    return np.array(out)


@QUIET
@given(st.lists(st.tuples(st.integers(1, 90), st.integers(1, 40)), min_size=1, max_size=5), st.booleans())
def test_paused_line_stays_on_the_line(world: Any, pauses: list[tuple[int, int]], retreat: bool) -> None:
    arm, robot = Arm(FakeRobot().description, FakeRobot().limits, world, DT), FakeRobot()
    arm.sync(robot.observe())
    arm.pause_signal.style = "retreat" if retreat else "hold"
    begin, way = arm.pose_B_P.position_m, np.array([-0.05, 0.08, 0.03])
    held = {n for start, length in pauses for n in range(start, start + length)}
    guard = (lambda _: None) if retreat else None
    result, commands = play(arm, robot, arm.shift(way, 0.15, guard=guard), lambda n: n in held)
    assert result.completed
    assert result.travelled_m == pytest.approx(float(np.linalg.norm(way)))
    points = track(arm, commands)
    unit = way / np.linalg.norm(way)
    assert np.abs(np.cross(points - begin, unit)).max() < 1e-5, "off the line"
    along = (points - begin) @ unit
    assert along.min() > -1e-9
    assert along.max() < np.linalg.norm(way) + 1e-9
    np.testing.assert_allclose(points[-1], begin + way, atol=1e-6)
    # the limits hold all the way: speed and acceleration by differences of what is commanded
    speed = np.diff(np.concatenate([[0.0], along])) / DT
    assert np.abs(speed).max() <= 0.15 + 1e-4
    assert np.abs(np.diff(speed)).max() / DT <= arm.limits.tcp_acceleration_m_s2 * 1.05
    if not retreat:
        assert np.diff(along).min() > -1e-9, "went back"


def test_pause_stops_a_line_and_holds_it_still(arm: Arm, robot: FakeRobot) -> None:
    arm.sync(robot.observe())
    _, commands = play(arm, robot, arm.shift((0.0, 0.1, 0.0), 0.1), lambda n: 40 <= n < 2040)
    still = [i for i, c in enumerate(commands) if c.motion is None]
    assert still[0] - 40 < 20, "the stop took longer than 0.2 s"
    assert len(still) > 1950
    assert still == list(range(still[0], still[-1] + 1)), "the arm moved during the pause"


def test_finish_style_completes_the_motion(arm: Arm, robot: FakeRobot) -> None:
    arm.sync(robot.observe())
    arm.pause_signal.style = "finish"
    result, commands = play(arm, robot, arm.shift((0.0, 0.1, 0.0), 0.1), lambda n: n > 10)
    assert result.completed
    assert all(c.motion is not None for c in commands)


def test_finishing_section_is_not_interrupted(arm: Arm, robot: FakeRobot) -> None:
    arm.sync(robot.observe())

    def closing() -> Generator[Command, Observation, MoveResult]:
        with arm.pause_signal.finishing():
            return (yield from arm.shift((0.0, 0.1, 0.0), 0.1))

    _, commands = play(arm, robot, closing(), lambda n: n > 10)
    assert all(c.motion is not None for c in commands)
    assert not arm.pause_signal.deferred


@QUIET
@given(start=st.integers(1, 250), length=st.integers(1, 300))
def test_guard_trips_at_the_same_wall_with_and_without_a_pause(world: Any, start: int, length: int) -> None:
    """Stop at a spring wall with the same bound on the force, with and without a pause."""
    gap, stiffness, speed = 0.03, 3000.0, 0.02
    description = FakeRobot().description
    arm = Arm(description, FakeRobot().limits, world, DT)
    arm.pause_signal.style = "retreat"
    face = arm.pose_B_P.apply((0.0, 0.0, 0.13)) + np.array([0.0, gap + 0.006, 0.0])
    robot = FakeRobot(walls=[SpringWall(face, np.array([0.0, -1.0, 0.0]), stiffness)])
    arm.sync(robot.observe())

    def guard(seen: Observation) -> str | None:
        return "touch" if np.linalg.norm(seen.wrench_S[:, :3], axis=1).max() > 0.5 else None

    move = arm.shift((0.0, 0.06, 0.0), speed, guard=guard, check=False)
    result, _ = play(arm, robot, move, lambda n: start <= n < start + length)
    assert result.stop == "touch"
    assert gap < result.travelled_m < gap + 0.0015
    assert robot.peak_force_N < stiffness * 0.0012
    # the retreat leaves the wall, and the return ends at the same joint positions
    at = arm.q.copy()
    arm.pause_signal.requested = False
    out, _ = play(arm, robot, arm.retreat(), lambda _: True)
    assert np.linalg.norm(robot.observe().wrench_S[-1, :3]) < 1e-9
    assert np.linalg.norm(arm.pose_B_P.position_m - arm.kinematics.fk(at).position_m) == pytest.approx(
        RETREAT_M, abs=1e-4
    )
    play(arm, robot, arm.return_to_contact(out), lambda _: True)
    np.testing.assert_array_equal(arm.q, at)


def test_guard_that_trips_during_a_pause_reports_a_contact(arm: Arm, robot: FakeRobot) -> None:
    arm.sync(robot.observe())
    cycles = [0]

    def guard(seen: Observation) -> str | None:
        cycles[0] += 1
        return "pushed" if cycles[0] == 200 else None

    result, commands = play(arm, robot, arm.shift((0.0, 0.1, 0.0), 0.05, guard=guard), lambda n: n > 20)
    assert result.stop == "pushed"
    assert not result.completed
    assert len(commands) == 200
    assert not arm.pause_signal.standing
    assert not arm.pause_signal.handled


def test_guard_evaluates_every_sample_when_a_motion_starts_paused(arm: Arm, robot: FakeRobot) -> None:
    """The guard's baseline was taken just before, so it must see every later sample."""
    arm.sync(robot.observe())
    stamps: list[float] = []
    arm.pause_signal.requested = True
    move = arm.shift((0.0, 0.02, 0.0), 0.05, guard=lambda seen: stamps.extend(seen.stamp_s.tolist()))
    result, commands = play(arm, robot, move, lambda n: n < 50)
    assert result.completed
    assert sum(c.motion is None for c in commands) == 50
    assert len(stamps) == 10 * len(commands)


@QUIET
@given(start=st.integers(1, 150), length=st.integers(1, 60))
def test_paused_joint_move_stays_on_its_line(kinematics: Kinematics, world: Any, start: int, length: int) -> None:
    robot = FakeRobot(kinematics.description)
    arm = Arm(kinematics.description, robot.limits, world, DT)
    arm.sync(robot.observe())
    begin = arm.q.copy()
    end = begin + np.array([0.3, -0.1, 0.2, 0.0, 0.1, 0.2, -0.4])
    _, commands = play(arm, robot, arm.joints(end, check=False), lambda n: start <= n < start + length)
    q = np.array([c.motion.q for c in commands if c.motion is not None])
    share = (q - begin) @ (end - begin) / ((end - begin) @ (end - begin))
    np.testing.assert_allclose(q, begin + share[:, None] * (end - begin), atol=1e-9)
    assert np.diff(share).min() > -1e-12
    np.testing.assert_allclose(q[-1], end, atol=1e-12)


def test_closing_a_paused_motion_resets_the_pause_signal(arm: Arm, robot: FakeRobot) -> None:
    arm.sync(robot.observe())
    motion = arm.shift((0.0, 0.1, 0.0), 0.05)
    command = next(motion)
    for _ in range(60):
        arm.pause_signal.requested = True
        command = motion.send(robot.cycle(command))
    assert arm.pause_signal.standing
    motion.close()
    assert not arm.pause_signal.standing
    assert not arm.pause_signal.handled
