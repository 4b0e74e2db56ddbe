"""Pinocchio against MuJoCo, finite differences, and round trips."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_bt.motion import Kinematics
from glotouch_bt.robot import MotionRefused, ParamError, Pose, RobotDescription
from glotouch_bt.robot.fake import FAKE_ARM
from glotouch_bt.robot.geometry import quat_to_matrix


def rpy_quat(rpy: tuple[float, float, float]) -> np.ndarray:
    quat = np.zeros(4)
    mujoco.mju_euler2Quat(quat, np.array(rpy), "XYZ")  # capitals: fixed axes
    return quat


def mujoco_chain(description: RobotDescription) -> mujoco.MjModel:
    """A bare chain of bodies and hinges, with a site at P."""
    spec = mujoco.MjSpec()
    body = spec.worldbody
    for joint in description.joints:
        body = body.add_body(name=joint.link.name, pos=joint.origin_m, quat=rpy_quat(joint.origin_rpy_rad))
        body.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis, armature=joint.armature_kgm2)
        body.mass, body.ipos = joint.link.mass_kg, joint.link.com_m
        body.fullinertia, body.explicitinertial = joint.link.inertia_kgm2, True
    hand = description.gripper
    flange = body.add_body(name="flange", pos=description.pose_last_E.position_m, quat=description.pose_last_E.quat)
    flange.mass, flange.ipos = hand.mass_kg, hand.com_E_m
    flange.inertia, flange.explicitinertial = np.full(3, 1e-12), True
    flange.add_site(name="P", pos=hand.pose_E_P.position_m, quat=hand.pose_E_P.quat)
    model: mujoco.MjModel = spec.compile()
    return model


def step(kinematics: Kinematics, pose: Pose, q: np.ndarray) -> np.ndarray:
    return q + kinematics.path_step(pose.position_m, pose.rotation, q, np.zeros(6))[0]


@pytest.mark.parametrize("description", [RIZON4_XENSE, FAKE_ARM], ids=lambda d: d.name)
def test_forward_kinematics_and_jacobian_agree_with_mujoco(description: RobotDescription) -> None:
    kinematics, model = Kinematics(description), mujoco_chain(description)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    for _ in range(200):
        q = rng.uniform(kinematics.lower, kinematics.upper)
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        pose = kinematics.fk(q)
        np.testing.assert_allclose(pose.position_m, data.site("P").xpos, atol=1e-9)
        np.testing.assert_allclose(pose.rotation, data.site("P").xmat.reshape(3, 3), atol=1e-9)
        assert pose.quat[0] >= 0
        jp, jr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, jp, jr, model.site("P").id)
        np.testing.assert_allclose(kinematics.jacobian(q), np.vstack([jp, jr]), atol=1e-9)
        rotations, origins = kinematics.link_placements(q)
        for i, joint in enumerate(description.joints):
            np.testing.assert_allclose(origins[i], data.body(joint.link.name).xpos, atol=1e-9)
            np.testing.assert_allclose(rotations[i], data.body(joint.link.name).xmat.reshape(3, 3), atol=1e-9)


def test_jacobian_is_the_derivative(kinematics: Kinematics) -> None:
    rng = np.random.default_rng(1)
    h = 1e-6
    for _ in range(20):
        q = rng.uniform(kinematics.lower, kinematics.upper)
        j, here = kinematics.jacobian(q), kinematics.fk(q).rotation
        for i in range(len(q)):
            step = np.zeros(len(q))
            step[i] = h
            (p1, r1), (p0, r0) = kinematics.place(q + step), kinematics.place(q - step)
            np.testing.assert_allclose(j[:3, i], (p1 - p0) / (2 * h), atol=1e-8)
            spin = (r1 - r0) / (2 * h) @ here.T
            np.testing.assert_allclose(j[3:, i], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)


def test_flange_matches_the_vendors_check_values() -> None:
    """Poses that other software computed from flexiv_description."""
    from glotouch_backends.rizon4 import XENSE_GRIPPER

    kinematics = Kinematics(RIZON4_XENSE)
    for degrees, position, quat in (
        ([0.0] * 7, (0.096, -0.113, 1.255), (0.7071, 0.0, 0.7071, 0.0)),
        ([0.0, -40.0, 0.0, 90.0, 0.0, 40.0, 0.0], (0.687, -0.113, 0.3266), (0.0, 0.0, 1.0, 0.0)),
    ):
        flange = kinematics.fk(np.radians(degrees)) @ XENSE_GRIPPER.pose_E_P.inverse()
        np.testing.assert_allclose(flange.position_m, position, atol=6e-5)
        assert abs(float(flange.quat @ np.array(quat))) == pytest.approx(1.0, abs=1e-4)


def test_home_points_straight_down_over_the_container(kinematics: Kinematics) -> None:
    pose = kinematics.fk(kinematics.home)
    np.testing.assert_allclose(pose.rotation[:, 2], [0.0, 0.0, -1.0], atol=1e-7)
    np.testing.assert_allclose(pose.position_m, [0.60, 0.0, 0.10], atol=1e-7)


def test_ik_round_trip_over_the_workspace(kinematics: Kinematics) -> None:
    """Pads .02-.35 m above the floor over the whole container, yaw -90..90 from home, base .20 above the floor."""
    worst = np.inf
    for x in (0.46, 0.60, 0.74):
        for y in (-0.19, 0.0, 0.19):
            for z in (0.02, 0.15, 0.35):
                for yaw in np.radians([-90.0, -45.0, 0.0, 45.0, 90.0]):
                    pose = Pose.pointing_down((x, y, z - 0.20), np.pi + yaw)
                    q = kinematics.ik(pose, kinematics.home)
                    reached = kinematics.fk(q)
                    assert np.linalg.norm(reached.position_m - pose.position_m) < 2e-8
                    assert abs(float(reached.quat @ pose.quat)) > 1 - 1e-12
                    margin = min(float((q - kinematics.lower).min()), float((kinematics.upper - q).min()))
                    worst = min(worst, margin)
    assert np.degrees(worst) > 10.0


def test_ik_recovers_random_configurations(kinematics: Kinematics) -> None:
    rng = np.random.default_rng(2)
    for _ in range(60):
        q = kinematics.home + rng.uniform(-0.4, 0.4, 7)
        pose = kinematics.fk(q)
        found = kinematics.ik(pose, q + rng.uniform(-0.1, 0.1, 7), posture_weight=0.0)
        assert np.linalg.norm(kinematics.fk(found).position_m - pose.position_m) < 2e-8
        assert np.all(found >= kinematics.lower)
        assert np.all(found <= kinematics.upper)


def test_posture_weight_moves_the_null_space_towards_home(kinematics: Kinematics) -> None:
    pose = kinematics.fk(kinematics.home)
    swung = kinematics.home.copy()
    for _ in range(100):  # along the null space, away from home
        null = np.linalg.svd(kinematics.jacobian(swung))[2][-1]
        swung = step(kinematics, pose, swung + 0.005 * np.sign(null[0]) * null)
    assert np.linalg.norm(swung - kinematics.home) > 0.2
    np.testing.assert_allclose(kinematics.ik(pose, swung), kinematics.home, atol=5e-3)
    free = kinematics.ik(pose, swung, posture_weight=0.0)
    np.testing.assert_allclose(free, swung, atol=1e-4)


def test_out_of_reach_is_refused_with_the_distance(kinematics: Kinematics) -> None:
    with pytest.raises(MotionRefused, match=r"cannot be reached, the nearest is \d+\.\d mm away"):
        kinematics.ik(Pose.pointing_down((1.4, 0.0, 0.0), 0.0), kinematics.home)


def test_step_converges_quadratically(kinematics: Kinematics) -> None:
    pose = kinematics.fk(kinematics.home)
    q = kinematics.home + 1e-3
    errors = []
    for _ in range(3):
        q = step(kinematics, pose, q)
        errors.append(float(np.linalg.norm(kinematics.fk(q).position_m - pose.position_m)))
    assert errors[0] < 1e-5
    assert errors[1] < 1e-9


def test_wrong_shape_is_refused(kinematics: Kinematics) -> None:
    with pytest.raises(ParamError):
        kinematics.fk(np.zeros(6))


def test_inertias_are_physical() -> None:
    for link in (RIZON4_XENSE.base, *(j.link for j in RIZON4_XENSE.joints)):
        xx, yy, zz, xy, xz, yz = link.inertia_kgm2
        a, b, c = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert a > 0
        assert a + b >= c
    total = sum(j.link.mass_kg for j in RIZON4_XENSE.joints)
    assert total == pytest.approx(16.4)
    np.testing.assert_allclose(quat_to_matrix(RIZON4_XENSE.pose_last_E.quat), np.diag([-1.0, -1.0, 1.0]), atol=1e-12)
