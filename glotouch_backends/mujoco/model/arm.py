"""The arm as a MuJoCo chain, built from its description so that every model of it agrees."""

from __future__ import annotations

import mujoco
import numpy as np

from glotouch_backends.mujoco.model.contact import HAND, HAND_FRICTION, set_category, set_friction
from glotouch_bt.robot import Array, Link, ParamError, RobotDescription, matrix_to_quat

JOINT_DAMPING = 2.0  # Nm s/rad
# Position servo, proximal to distal: the stiffness that tracked 60 mm/s to 0.12 mm and gave 0.13-0.19 mm/N at the hand.
STIFFNESS_NM_RAD = (10000.0, 10000.0, 6000.0, 6000.0, 3000.0, 3000.0, 3000.0)
DAMPING_PER_STIFFNESS_S = 0.04
ARM_COLOUR = (0.80, 0.82, 0.85, 1.0)


def rpy_quat(rpy_rad: tuple[float, float, float]) -> Array:
    """Quaternion (4,) w x y z of fixed-axis roll, pitch, yaw: Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy_rad), np.sin(rpy_rad)
    return matrix_to_quat(
        np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
    )


def _dress(body: mujoco.MjsBody, link: Link) -> None:
    """Inertia and collision capsules of one link; its weight is carried by the controller (gravcomp)."""
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


def add_arm(spec: mujoco.MjSpec, description: RobotDescription) -> mujoco.MjsBody:
    """Add the arm and its servos (actuators named as the joints). Returns the body of the flange frame E, still empty.

    Raises:
        ParamError: The servo gains are for a seven-axis arm.
    """
    if description.dof != len(STIFFNESS_NM_RAD):
        raise ParamError("description.dof", description.dof, f"{len(STIFFNESS_NM_RAD)}")
    body = spec.worldbody.add_body(name=description.base.name)
    _dress(body, description.base)
    for geom in body.geoms:  # the base stands on the table
        geom.contype = geom.conaffinity = 0
    for joint, kp in zip(description.joints, STIFFNESS_NM_RAD, strict=True):
        body = body.add_body(name=joint.link.name, pos=joint.origin_m, quat=rpy_quat(joint.origin_rpy_rad))
        if joint is description.joints[0]:  # the moving root decides for its whole tree
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
        servo.set_to_position(kp=kp, kv=DAMPING_PER_STIFFNESS_S * kp)
        servo.forcelimited = True
        servo.forcerange = (-joint.torque_Nm, joint.torque_Nm)
    return body.add_body(name="hand", pos=description.pose_last_E.position_m, quat=description.pose_last_E.quat)
