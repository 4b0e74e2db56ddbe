"""The compiled arm against the description, computed independently: SciPy rotations and finite differences."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glotouch_backends.mujoco.robot import MujocoRobot
from glotouch_bt.robot import Array

Open = Callable[..., MujocoRobot]


@pytest.fixture
def robot(open_robot: Open) -> MujocoRobot:
    return open_robot()


def chain(robot: MujocoRobot, q: Array) -> list[tuple[Array, Rotation]]:
    """Return origin and rotation of every link frame in B, then of P."""
    at, turn, frames = np.zeros(3), Rotation.identity(), []
    for joint, angle in zip(robot.description.joints, q, strict=True):
        at = at + turn.apply(joint.origin_m)
        turn = (
            turn * Rotation.from_euler("xyz", joint.origin_rpy_rad) * Rotation.from_rotvec(angle * np.array(joint.axis))
        )
        frames.append((at, turn))
    for pose in (robot.description.pose_last_E, robot.description.gripper.pose_E_P):
        at = at + turn.apply(np.array(pose.position_m))
        turn = turn * Rotation.from_matrix(np.array(pose.rotation))
    return [*frames, (at, turn)]


def postures(robot: MujocoRobot, n: int) -> list[Array]:
    rng = np.random.default_rng(1)
    joints = robot.description.joints
    return list(rng.uniform([j.lower_rad for j in joints], [j.upper_rad for j in joints], (n, len(joints))))


def test_kinematics(robot: MujocoRobot) -> None:
    data, h = mujoco.MjData(robot.model), robot.handles
    for q in postures(robot, 20):
        data.qpos[h.arm_qpos] = q
        mujoco.mj_kinematics(robot.model, data)
        at, turn = chain(robot, q)[-1]
        np.testing.assert_allclose(data.site_xpos[h.pads_site], at, atol=1e-12)
        np.testing.assert_allclose(data.site_xmat[h.pads_site].reshape(3, 3), turn.as_matrix(), atol=1e-12)


def test_gravity_torque_is_the_slope_of_the_potential(robot: MujocoRobot) -> None:
    """Virtual work: dU/dq with U = sum m g z of links and hand, from the description's masses."""
    d, h = robot.description, robot.handles
    g = d.gripper
    finger_com_E = g.pose_E_P.apply(g.finger.centre_m) * (1.0, 0.0, 1.0)

    def potential(q: Array) -> float:
        frames = chain(robot, q)
        total = 0.0
        for joint, (at, turn) in zip(d.joints, frames, strict=False):
            total += joint.link.mass_kg * (at + turn.apply(joint.link.com_m))[2]
        at, turn = frames[len(d.joints) - 1]
        at, turn = (
            at + turn.apply(np.array(d.pose_last_E.position_m)),
            turn * Rotation.from_matrix(np.array(d.pose_last_E.rotation)),
        )
        total += g.mass_kg * (at + turn.apply(g.com_E_m))[2]
        total += 2 * g.finger_mass_kg * (at + turn.apply(finger_com_E))[2]
        return 9.81 * total

    data = mujoco.MjData(robot.model)
    for q in postures(robot, 5):
        data.qpos[h.arm_qpos] = q
        data.qpos[h.jaw_qpos] = 0.0
        mujoco.mj_forward(robot.model, data)
        step = 1e-6 * np.eye(7)
        slope = [(potential(q + e) - potential(q - e)) / 2e-6 for e in step]
        np.testing.assert_allclose(data.qfrc_bias[h.arm_dof], slope, atol=2e-3)  # backs of the fingers: 1 mm off
        np.testing.assert_allclose(data.qfrc_gravcomp[h.arm_dof], data.qfrc_bias[h.arm_dof], atol=1e-9)


def test_limits_equal_those_of_the_description(robot: MujocoRobot) -> None:
    for joint in robot.description.joints:
        np.testing.assert_allclose(robot.model.joint(joint.name).range, (joint.lower_rad, joint.upper_rad))
        assert robot.model.joint(joint.name).armature[0] == joint.armature_kgm2
        np.testing.assert_allclose(robot.model.actuator(joint.name).forcerange, (-joint.torque_Nm, joint.torque_Nm))
