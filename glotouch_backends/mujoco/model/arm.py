"""The arm as a MuJoCo chain, built from its description."""

from __future__ import annotations

import re

import mujoco
import numpy as np

from glotouch_backends.mujoco.model.contact import HAND, HAND_FRICTION, set_category, set_friction
from glotouch_backends.mujoco.truth import rotation_vector
from glotouch_bt.robot import Array, Link, ParamError, Pose, RobotDescription, matrix_to_quat, rpy_to_matrix

JOINT_DAMPING = 2.0
"""Joint damping, Nm s/rad. Source: ours."""
DAMPING_PER_STIFFNESS_S = 0.04
"""Servo damping over stiffness, s. Source: ours."""
ARM_COLOUR = (0.80, 0.82, 0.85, 1.0)


def _dress(body: mujoco.MjsBody, link: Link) -> None:
    """Set inertia and collision capsules of one link; the controller carries its weight (gravcomp)."""
    body.explicitinertial = True
    body.mass = link.mass_kg
    body.ipos = link.com_m
    body.fullinertia = link.inertia_kgm2
    body.gravcomp = 1.0
    for capsule in link.capsules:
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, rgba=ARM_COLOUR)
        geom.fromto = (*capsule.start_m, *capsule.end_m)
        geom.size = (capsule.radius_m, 0.0, 0.0)
        geom.mass = 0.0
        set_category(geom, HAND)
        set_friction(geom, HAND_FRICTION)


def _require_simulable(description: RobotDescription) -> None:
    for joint in description.joints:
        if not joint.servo_stiffness_Nm_rad > 0.0:
            value = joint.servo_stiffness_Nm_rad
            raise ParamError(f"{joint.name}.servo_stiffness_Nm_rad", value, "positive to simulate the arm")
    own = r"hand|probe|holder|container|finger_.*|object\d+|tip|jaw_.*"
    for name in (description.base.name, *(n for j in description.joints for n in (j.name, j.link.name))):
        if re.fullmatch(own, name):
            raise ParamError("name of a link or joint", name, "another one: the simulated world uses it")


def add_arm(spec: mujoco.MjSpec, description: RobotDescription, errors_rad: Array) -> mujoco.MjsBody:
    """Add the arm and its servos (actuators named as the joints); return the body of the flange frame E, still empty.

    `errors_rad` (joints, 3) are rotation vectors by which the true joint frames differ from the description.

    Raises:
        ParamError: A joint has no servo stiffness, or the world has a body of the name of a link.
    """
    _require_simulable(description)
    body = spec.worldbody.add_body(name=description.base.name)
    _dress(body, description.base)
    for geom in body.geoms:  # the base stands on the table
        geom.contype = geom.conaffinity = 0
    for joint, error in zip(description.joints, errors_rad, strict=True):
        quat = matrix_to_quat(rpy_to_matrix(joint.origin_rpy_rad))
        if error.any():
            quat = (Pose(np.zeros(3), quat) @ rotation_vector(error)).quat
        body = body.add_body(name=joint.link.name, pos=joint.origin_m, quat=quat)
        if joint is description.joints[0]:  # the sleep policy of a tree is that of its root
            body.sleep = mujoco.mjtSleepPolicy.mjSLEEP_NEVER
        body.add_joint(
            name=joint.name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=joint.axis,
            range=(joint.lower_rad, joint.upper_rad),
            limited=True,
            armature=joint.armature_kgm2,
            damping=JOINT_DAMPING,
        )
        _dress(body, joint.link)
        servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(
            kp=joint.servo_stiffness_Nm_rad, kv=DAMPING_PER_STIFFNESS_S * joint.servo_stiffness_Nm_rad
        )
        servo.forcelimited = True
        servo.forcerange = (-joint.torque_Nm, joint.torque_Nm)
    return body.add_body(name="hand", pos=description.pose_last_E.position_m, quat=description.pose_last_E.quat)
