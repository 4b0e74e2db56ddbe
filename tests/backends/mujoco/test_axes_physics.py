"""Models of arm, probe, jaws, wrist sensor and contacts against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from glotouch_backends.mujoco import MujocoBackend
from glotouch_backends.mujoco.control import JawReports
from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_backends.mujoco.sensing import WristSensor, up_in
from glotouch_backends.mujoco.sensing.wrench import calibration_errors
from glotouch_backends.mujoco.truth import joint_poses, rotation_vector
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.robot import Conditions, GripperState, Pose
from glotouch_bt.robot.scene import Mesh

Drive = Callable[[MujocoRobot], Any]
Open = Callable[..., MujocoRobot]
ABOUT, ACROSS = 0.002, 0.0004
DOWN = np.array([0.0, 1.0, 0.0, 0.0])


def described_pose(q: Any) -> Pose:
    """Forward kinematics of the described arm at joint positions."""
    joint, description = RIZON4_XENSE.joints[-1], RIZON4_XENSE
    last = joint_poses(description, q)[-1] @ rotation_vector(q[-1] * np.asarray(joint.axis))
    return last @ description.pose_last_E @ description.gripper.pose_E_P


def test_the_reported_pose_is_that_of_the_described_arm(open_robot: Open, drive: Drive) -> None:
    robot = open_robot(Conditions(kinematic_error_sd_m=0.001), seed=1)
    driver = drive(robot)
    errors = []
    for place in ((0.60, 0.09, -0.12), (0.52, -0.1, 0.0)):
        seen = driver.line(place, settle_s=0.2)
        pose, true = described_pose(seen.q[-1]), np.array(robot.data.site_xpos[robot.handles.pads_site])
        np.testing.assert_allclose(seen.position_B_P[-1], pose.position_m, atol=5e-6)
        np.testing.assert_allclose(seen.pose_B_P.rotation, pose.rotation, atol=5e-6)
        errors.append(true - pose.position_m)
    assert 1e-4 < np.linalg.norm(errors[0]) < 4e-3
    assert 1e-5 < np.linalg.norm(errors[0] - errors[1]) < np.linalg.norm(errors[0]), "smooth over the box"


def test_the_kinematic_error_has_the_stated_sd(open_robot: Open) -> None:
    found = []
    for seed in range(12):
        robot = open_robot(Conditions(kinematic_error_sd_m=0.001), seed=seed)
        pose = described_pose(robot.observe().q[-1])
        found.append(robot.data.site_xpos[robot.handles.pads_site] - pose.position_m)
    assert np.std(found) == pytest.approx(0.001, rel=0.4)  # 36 numbers; home is 0.2 m above the place it is scaled for


def test_the_arm_lags_behind_by_the_following_error(open_robot: Open, drive: Drive) -> None:
    """At 50 mm/s, 6 ms are 0.3 mm."""
    last = []
    for lag_s in (0.0, 0.006):
        driver = drive(open_robot(Conditions(following_error_s=lag_s)))
        driver.line((0.60, 0.0, 0.05))
        driver.line((0.60, 0.08, 0.05), speed_m_s=0.05)
        last.append(np.array([o.position_B_P[-1] for o in driver.observations]))
    behind = last[0][:, 1] - last[1][:, 1]
    speed = np.gradient(last[0][:, 1], 0.010)
    moving = slice(-120, -30)
    np.testing.assert_allclose(behind[moving], 0.006 * speed[moving], atol=3e-5)


def test_the_held_ball_yields_by_the_compliance(open_robot: Open, drive: Drive) -> None:
    """Beyond what the grip itself yields: along x_P by the compliance about the jaws' axis, along y_P across."""
    moved = []
    for axes in (
        {},
        {"probe_compliance_about_m_per_N": (ABOUT,) * 2, "probe_compliance_across_m_per_N": (ACROSS,) * 2},
    ):
        robot = open_robot(Conditions(**axes))  # type: ignore[arg-type]
        driver, referee = drive(robot), MujocoBackend().referee(robot)
        assert referee is not None
        driver.pick()
        rotation, start = robot.observe().pose_B_P.rotation, referee.tip_B_m()
        yields = []
        for axis in (0, 1):
            referee.push_tip(rotation[:, axis])
            driver.wait(0.5)
            yields.append(rotation[:, axis] @ (referee.tip_B_m() - start))
            referee.push_tip(np.zeros(3))
            driver.wait(0.5)
            start = referee.tip_B_m()
        moved.append(yields)
    np.testing.assert_allclose(np.subtract(moved[1], moved[0]), [ABOUT, ACROSS], rtol=0.08)


def test_fingers_flex_and_the_drive_has_play() -> None:
    conditions = Conditions(
        finger_flex_m_per_N=1.5e-5, jaw_backlash_m=5e-5, jaw_force_gain=(1.1, 1.1), jaw_force_offset_N=(1.0, 1.0),
        aperture_resolution_m=0.0,
    )  # fmt: skip
    reports = JawReports(conditions, 0, 0.01, GripperState(0.0, 0.05, 0.0, False))
    closing = [reports.report(0.01, a, 0.0, 0.0).aperture_m for a in (0.05, 0.049, 0.048)]
    np.testing.assert_allclose(closing, [0.05 + 2.5e-5, 0.049 + 2.5e-5, 0.048 + 2.5e-5])
    opening = [reports.report(0.01, a, 0.0, 0.0).aperture_m for a in (0.04802, 0.049)]
    np.testing.assert_allclose(opening, [0.048 + 2.5e-5, 0.049 - 2.5e-5])
    squeezed = reports.report(0.01, 0.049, 0.0, 12.0)
    assert squeezed.aperture_m == pytest.approx(0.049 - 2 * 1.5e-5 * 12.0 + 2.5e-5)
    assert squeezed.force_N == pytest.approx((12.0 - 1.0) / 1.1)


def test_the_jaws_press_with_the_true_force(open_robot: Open, drive: Drive) -> None:
    robot = open_robot(Conditions(jaw_force_gain=(1.1, 1.1), jaw_force_offset_N=(-0.5, -0.5)))
    driver = drive(robot)
    assert driver.last.gripper.force_N == pytest.approx(0.0, abs=0.01)
    driver.jaws(0.070)
    driver.line((0.63, 0.08, -0.165), speed_m_s=0.2)
    driver.jaws(0.020, force_N=10.0)
    assert driver.last.gripper.force_N == pytest.approx(10.0, abs=0.2)
    force = robot.data.actuator_force[robot.handles.jaw_ctrl]
    np.testing.assert_allclose(np.abs(force), 10.0 * 1.1 - 0.5, atol=0.2)


def test_the_wrench_is_multiplied_by_the_calibration_matrix() -> None:
    conditions = Conditions(wrench_gain_sd=0.02, wrench_cross_talk_sd=0.02)
    sensor = WristSensor(RIZON4_XENSE, conditions, 3)
    gain, cross = calibration_errors(conditions, 3)
    true = np.random.default_rng(0).standard_normal((10, 6))
    weight = WristSensor(RIZON4_XENSE, Conditions(), 3).measure(np.zeros((10, 6)), up_in(DOWN)).copy()
    found = sensor.measure(true, up_in(DOWN)) - weight
    np.testing.assert_allclose(found, true @ (np.diag(1.0 + gain) + cross).T, atol=1e-12)
    drawn = [calibration_errors(conditions, seed) for seed in range(300)]
    assert np.std([g for g, _ in drawn]) == pytest.approx(0.02, rel=0.05)
    load = np.array([130.0] * 3 + [10.0] * 3)  # every axis at its range
    rows = np.array([c @ load / load for _, c in drawn])
    assert rows.std() == pytest.approx(0.02, rel=0.05)


def test_the_latency_jitters_within_its_bounds() -> None:
    sensor = WristSensor(RIZON4_XENSE, Conditions(wrench_latency_s=0.003, latency_jitter_s=0.002), 0)
    ramp = 0.001 * np.arange(3000.0)[:, None] * np.ones(6)
    offset = WristSensor(RIZON4_XENSE, Conditions(), 0).measure(np.zeros((10, 6)), up_in(DOWN))[0].copy()
    late = [
        round(float((ramp[i] - (sensor.measure(ramp[i : i + 10], up_in(DOWN))[0] - offset))[0] / 0.001))
        for i in range(100, 3000, 10)
    ]
    assert set(late[2:]) == {1, 2, 3, 4, 5}


def test_the_torques_drift() -> None:
    ends, still = [], np.zeros((10, 6))
    for seed in range(24):
        sensor = WristSensor(RIZON4_XENSE, Conditions(torque_drift_Nm_per_sqrt_min=0.005), seed)
        first = sensor.measure(still, up_in(DOWN))[0].copy()
        for _ in range(6000):
            last = sensor.measure(still, up_in(DOWN))[-1]
        assert np.array_equal(last[:3], first[:3])
        ends.append(last[3:] - first[3:])
    assert np.std(ends) == pytest.approx(0.005, rel=0.25)  # 72 numbers


def test_objects_lean_and_the_floor_tilts(open_robot: Open) -> None:
    robot = open_robot(Conditions(object_lean_deg=(3.0, 3.0)))
    up = robot.data.xmat[robot.handles.object_bodies[0]].reshape(3, 3)[:, 2]
    assert np.rad2deg(np.arccos(up[2])) == pytest.approx(3.0, abs=0.1)
    tilts = []
    for seed in range(30):
        up = open_robot(Conditions(floor_tilt_sd_deg=0.5), seed=seed).truth.pose_B_K.rotation[:, 2]
        tilts.append(np.rad2deg(up[:2]))
    assert np.std(tilts) == pytest.approx(0.5, rel=0.3)


def test_contacts_have_the_drawn_time_constants(open_robot: Open) -> None:
    robot = open_robot(Conditions(contact_softness_s=(0.003, 0.003), housing_softness_s=(0.020, 0.020)))
    model = robot.model
    times = {model.geom(name).id: model.geom_solref[model.geom(name).id, 0] for name in ("floor", "pad_left", "ball")}
    assert list(times.values()) == [0.003, 0.007, 0.003]
    assert set(model.geom_solref[model.geom_bodyid == robot.handles.hand_bodies.start, 0]) == {0.020}
    bodies = robot.handles.object_bodies
    assert set(model.geom_solref[np.isin(model.geom_bodyid, bodies) & (model.geom_contype > 0), 0]) == {0.006}


def test_mass_and_centre_of_mass(open_robot: Open) -> None:
    robot = open_robot(Conditions(object_mass_kg=(0.05, 0.05), object_com_sd_m=0.003), seed=3)
    body = robot.handles.object_bodies[0]
    assert robot.model.body_mass[body] == pytest.approx(0.05)
    mesh: Mesh = robot.truth.objects[0].mesh
    shift = robot.model.body_ipos[body] - mesh.as_trimesh().center_mass
    np.testing.assert_allclose(shift, robot.truth.objects[0].com_error_m, atol=1e-9)
    assert 0.0005 < np.linalg.norm(shift) < 0.02
