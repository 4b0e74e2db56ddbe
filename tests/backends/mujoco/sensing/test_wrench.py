"""The wrist sensor: closed forms of its disturbances, and statics of the simulated hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.mujoco.sensing.wrench import WristSensor, up_in, weight_matrix
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import Array, Conditions, SetPayload, Tare

Open = Callable[..., MujocoRobot]
Drive = Callable[[MujocoRobot], Any]
HAND_KG = 0.704 + 2 * 0.09
DOWN = np.array([0.0, 1.0, 0.0, 0.0])  # z_S = -z_B


def weight(mass_kg: float, com_S_m: Array, rotation: Rotation) -> Array:
    """Force and torque in S of a hanging mass, through SciPy's rotations."""
    force = rotation.inv().apply([0.0, 0.0, -mass_kg * 9.81])
    return np.concatenate([force, np.cross(com_S_m, force)])


def test_weight_in_any_orientation() -> None:
    com = np.array([0.01, -0.02, 0.15])
    for rotation in Rotation.random(10, rng=np.random.default_rng(0)):
        quat = np.roll(rotation.as_quat(), 1)
        np.testing.assert_allclose(weight_matrix(0.7, com) @ up_in(quat), weight(0.7, com, rotation), atol=1e-12)


def report(sensor: WristSensor, true: Array, quat_B_S: Array) -> Array:
    return sensor.measure(true, up_in(quat_B_S)) - sensor.bias


def test_latency_is_a_delay() -> None:
    sensor = WristSensor(RIZON4_XENSE, Conditions(wrench_latency_s=0.003), 0)
    ramp = np.arange(40.0)[:, None] * np.ones(6)
    blocks = [report(sensor, ramp[i : i + 10], DOWN) for i in range(0, 40, 10)]
    np.testing.assert_allclose(np.concatenate(blocks)[3:], ramp[:-3], atol=1e-12)


def test_noise_and_drift_have_the_stated_spread() -> None:
    seconds, still = 60.0, np.zeros((10, 6))
    ends, whites = [], []
    for seed in range(24):
        sensor = WristSensor(
            RIZON4_XENSE,
            Conditions(force_noise_sd_N=0.05, torque_noise_sd_Nm=0.003, force_drift_N_per_sqrt_min=0.03),
            seed,
        )
        blocks = np.concatenate([report(sensor, still, DOWN) for _ in range(round(seconds * 100))])
        ends.append(blocks[-1000:, :3].mean(axis=0))
        whites.append(np.diff(blocks, axis=0).std(axis=0) / np.sqrt(2))
    np.testing.assert_allclose(np.mean(whites, axis=0), [0.05] * 3 + [0.003] * 3, rtol=0.01)
    assert 0.02 < np.std(ends) < 0.04  # 72 draws of sd 0.03 N after a minute


def test_after_a_tare_a_tilt_leaves_only_the_payload_error() -> None:
    """The controller's weight model is wrong by 2 % of 8.65 N; a tilt of 30 degrees shows the error."""
    ideal = WristSensor(RIZON4_XENSE, Conditions(), 0)
    wrong = WristSensor(RIZON4_XENSE, Conditions(payload_mass_error=0.02, payload_com_error_m=0.002), 0)
    mass, com = RIZON4_XENSE.gripper.mass_and_com_E()
    down = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
    tilted = down * Rotation.from_euler("y", 30, degrees=True)
    quat = np.roll(tilted.as_quat(), 1)
    for sensor in (ideal, wrong):
        at_rest = np.tile(weight(mass, com, down), (10, 1))
        assert report(sensor, at_rest, DOWN)[0, 2] == pytest.approx(mass * 9.81)  # before: the whole weight
        sensor.tare(sensor.measure(at_rest, up_in(DOWN)).mean(axis=0), up_in(DOWN))
        assert np.abs(report(sensor, at_rest, DOWN)).max() < 1e-12
    there = np.tile(weight(mass, com, tilted), (10, 1))
    assert np.abs(report(ideal, there, quat)).max() < 1e-9
    left = np.linalg.norm(report(wrong, there, quat)[0, :3])
    assert 0.0 < left < 4 * 0.02 * mass * 9.81 * 2 * np.sin(np.deg2rad(15))


def test_the_sensor_carries_the_weight_of_the_hand(open_robot: Open) -> None:
    robot = open_robot()
    wrench = robot.observe().wrench_S[-1]
    expected = weight(
        *RIZON4_XENSE.gripper.mass_and_com_E(), Rotation.from_quat(np.roll(robot.observe().quat_B_P[-1], -1))
    )
    np.testing.assert_allclose(wrench, expected, atol=2e-3)
    assert wrench[2] == pytest.approx(HAND_KG * 9.81, abs=2e-2)  # z_S points down


def test_the_weight_of_the_probe_shows_until_the_payload_is_set(open_robot: Open, drive: Drive) -> None:
    """Tare without the probe, then pick it up."""
    driver = drive(open_robot())
    driver.request(Tare())
    assert np.abs(driver.last.wrench_S).max() < 1e-3
    driver.pick()
    np.testing.assert_allclose(driver.wait(0.3).wrench_S.mean(axis=0)[:3], [0.0, 0.0, 0.060 * 9.81], atol=5e-3)
    before = driver.last.position_B_P[-1, 2]
    driver.request(SetPayload(0.060, np.array([0.0, 0.0, 0.030])))
    assert np.abs(driver.wait(0.3).wrench_S.mean(axis=0)).max() < 5e-3
    assert driver.last.position_B_P[-1, 2] > before  # and the arm carries it: it no longer sags


def test_torque_of_a_contact_at_the_tip(open_robot: Open, drive: Drive) -> None:
    """The ball presses on the wall: the torque at S is the tip's lever times the force away from the wall."""
    driver = drive(open_robot())
    driver.pick()
    driver.line((0.60, 0.0, 0.02))
    driver.line((0.60, 0.15, -0.02))
    driver.request(Tare())
    driver.line(
        (0.60, 0.21, -0.02), speed_m_s=0.04, until=lambda o: np.linalg.norm(o.wrench_S[-1, :3]) > 1.0, settle_s=0.3
    )
    robot = driver.robot
    wrench = driver.last.wrench_S.mean(axis=0)
    rotation = robot.data.site_xmat[robot.handles.sensor_site].reshape(3, 3)
    force_B = rotation @ wrench[:3]
    assert force_B[1] < -1.0
    lever_S = rotation.T @ (
        driver.tip() + np.array([0.0, 0.006, 0.0]) - robot.data.site_xpos[robot.handles.sensor_site]
    )
    np.testing.assert_allclose(wrench[3:], np.cross(lever_S, wrench[:3]), atol=2e-3)


def test_pressing_the_floor_gives_an_upward_force(open_robot: Open, drive: Drive) -> None:
    driver = drive(open_robot())
    driver.request(Tare())
    driver.jaws(0.02, time_s=0.5)
    x, y, _ = driver.pose.position_m
    driver.line((x, y, -0.17))
    driver.line((x, y, -0.20), speed_m_s=0.02, until=lambda o: np.linalg.norm(o.wrench_S[-1, :3]) > 3.0, settle_s=0.3)
    robot = driver.robot
    force_B = robot.data.site_xmat[robot.handles.sensor_site].reshape(3, 3) @ driver.last.wrench_S.mean(axis=0)[:3]
    assert force_B[2] > 3.0
    truth = [
        sum(robot.data.cfrc_ext[b, 5] for b in range(robot.handles.hand_bodies.start, robot.handles.hand_bodies.stop))
    ]
    assert force_B[2] == pytest.approx(truth[0], abs=0.02)
