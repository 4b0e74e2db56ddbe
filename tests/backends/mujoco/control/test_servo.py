"""Interpolation against SciPy, tracking of setpoints, and refused commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from glotouch_backends.mujoco.control.servo import hermite
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.robot import HOLD, Command, JointSetpoint, ParamError, Pose

Open = Callable[..., MujocoRobot]
Drive = Callable[[MujocoRobot], Any]


def test_hermite_bases() -> None:
    period = 0.01
    position, velocity = hermite(period, 10)
    q0, dq0, q1, dq1 = knots = np.array([0.3, -0.5, 0.31, 0.9])
    spline = CubicHermiteSpline([0.0, period], [q0, q1], [dq0, dq1])
    t = np.arange(10) * period / 10
    np.testing.assert_allclose(position @ knots, spline(t), atol=1e-14)
    np.testing.assert_allclose(velocity @ knots, spline(t, 1), atol=1e-11)


def test_holds_still_without_a_command(open_robot: Open) -> None:
    """Gravity compensation: nothing sags in two seconds."""
    robot = open_robot()
    start = robot.observe().q[-1]
    for _ in range(200):
        observation = robot.cycle(HOLD)
    assert np.abs(observation.q[-1] - start).max() < 1e-6
    assert observation.now_s == pytest.approx(2.0)


def test_follows_a_line(open_robot: Open, drive: Drive) -> None:
    robot = open_robot()
    driver = drive(robot)
    x, y, z = driver.pose.position_m
    driver.line((x, y - 0.15, z), speed_m_s=0.06)
    planned, measured = driver.planned, driver.observations[1 : len(driver.planned) + 1]
    errors = [np.linalg.norm(o.position_B_P[-1] - p.position_m) for o, p in zip(measured, planned, strict=True)]
    assert max(errors) < 2e-4
    assert errors[-1] < 5e-5


def test_stamps_are_every_millisecond(open_robot: Open) -> None:
    robot = open_robot()
    stamps = np.concatenate([robot.observe().stamp_s, *(robot.cycle(HOLD).stamp_s for _ in range(5))])
    np.testing.assert_allclose(np.diff(stamps), 1e-3, atol=1e-12)


def test_hold_brakes_to_rest(open_robot: Open, drive: Drive) -> None:
    """At v with deceleration a the hand stops after v^2 / 2a, and stays."""
    robot = open_robot()
    driver = drive(robot)
    x, y, z = driver.pose.position_m
    driver.line((x, y - 0.2, z), speed_m_s=0.10, until=lambda o: o.now_s > 1.5, settle_s=0.0)
    speed = np.linalg.norm(driver.planned[-1].position_m - driver.planned[-2].position_m) / robot.period_s
    robot.hold()
    at = robot.observe().position_B_P[-1]
    first = driver.wait(0.3).position_B_P[-1]
    last = driver.wait(0.2).position_B_P[-1]
    limit = robot.limits.stop_acceleration_m_s2
    assert 0.1 * speed**2 / 2 / limit < np.linalg.norm(first - at) < 2 * speed**2 / 2 / limit
    assert np.linalg.norm(last - first) < 1e-5


@pytest.mark.parametrize(
    ("field", "index", "value", "words"),
    [
        ("q", 0, np.nan, r"setpoint\.q\[joint1\]"),
        ("dq", 3, np.inf, r"setpoint\.dq\[joint4\]"),
        ("q", 1, -2.5, "within -2.2689"),
        ("dq", 0, 2.5, "rad/s"),
        ("q", 6, 0.9, "last q"),
        ("ddq", 2, np.nan, "ddq"),
    ],
)
def test_bad_setpoints_are_refused(open_robot: Open, field: str, index: int, value: float, words: str) -> None:
    robot = open_robot()
    good = JointSetpoint(np.array(robot.description.home_q), np.zeros(7), np.zeros(7), Pose(np.zeros(3)))
    bad = getattr(good, field).copy()
    bad[index] = value
    before = robot.observe()
    with pytest.raises(ParamError, match=words):
        robot.cycle(Command(motion=replace(good, **{field: bad})))
    assert robot.observe() is before  # nothing was sent, no time passed
    after = robot.cycle(Command(motion=good))
    assert np.abs(after.q[-1] - good.q).max() < 1e-6


def test_wrong_shape_is_refused(open_robot: Open) -> None:
    robot = open_robot()
    with pytest.raises(ParamError, match="shape"):
        robot.cycle(Command(motion=JointSetpoint(np.zeros(6), np.zeros(7), np.zeros(7), Pose(np.zeros(3)))))
