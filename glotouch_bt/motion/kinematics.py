"""Forward and inverse kinematics of an arm, computed with Pinocchio.

The model is built directly from the `RobotDescription`, so armature, velocity limits and all bodies are kept.
Frames: B arm base, P mid-point between the pads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.lazy import lazy_module
from glotouch_bt.robot import Array, Joint, Link, MotionRefused, ParamError, Pose, RobotDescription

if TYPE_CHECKING:
    import pinocchio as pin
else:
    pin = lazy_module("pinocchio")

_POSITION_TOLERANCE_M = 1e-8
"""Position error at which inverse kinematics stops."""
_ROTATION_TOLERANCE_RAD = 1e-7
"""Rotation error at which inverse kinematics stops."""
_MAX_STEP_RAD = 0.3
"""Maximum joint change per iteration."""
_MAX_ITERATIONS = 200
"""Maximum number of iterations per start."""


def se3(pose: Pose) -> pin.SE3:
    """Convert a pose to a Pinocchio SE3."""
    return pin.SE3(np.array(pose.rotation), np.array(pose.position_m))


def known_pose(position_m: Array, quat: Array) -> Pose:
    """Build a Pose from a finite position and a unit quaternion without checking them; make both read-only."""
    position_m.setflags(write=False)
    quat.setflags(write=False)
    pose = object.__new__(Pose)
    pose.__dict__["position_m"] = position_m
    pose.__dict__["quat"] = quat
    return pose


def build_model(description: RobotDescription) -> pin.Model:
    """Build the Pinocchio model of the arm: joints, limits, armature, link inertias and the frame "P".

    Gripper body and fingers (jaws closed) are appended to the last link, so that the mass matrix includes the hand.
    """
    model = pin.Model()
    model.name = description.name
    parent = 0
    for joint in description.joints:
        parent = model.addJoint(
            parent,
            _joint_model(joint),
            pin.SE3(pin.rpy.rpyToMatrix(*joint.origin_rpy_rad), np.array(joint.origin_m)),
            joint.name,
            np.array([joint.torque_Nm]),
            np.array([joint.velocity_rad_s]),
            np.array([joint.lower_rad]),
            np.array([joint.upper_rad]),
        )
        model.appendBodyToJoint(parent, _inertia(joint.link), pin.SE3.Identity())
    model.armature = np.array([j.armature_kgm2 for j in description.joints])
    hand = description.gripper
    last_E, E_P = se3(description.pose_last_E), se3(hand.pose_E_P)
    model.appendBodyToJoint(parent, pin.Inertia(hand.mass_kg, np.array(hand.com_E_m), np.zeros((3, 3))), last_E)
    fingers = pin.Inertia(2 * hand.finger_mass_kg, np.array([0.0, 0.0, hand.finger.centre_m[2]]), np.zeros((3, 3)))
    model.appendBodyToJoint(parent, fingers, last_E * E_P)
    model.addFrame(pin.Frame("P", parent, 0, last_E * E_P, pin.FrameType.OP_FRAME))
    return model


def _joint_model(joint: Joint) -> pin.JointModel:
    named = {
        (1.0, 0.0, 0.0): pin.JointModelRX,
        (0.0, 1.0, 0.0): pin.JointModelRY,
        (0.0, 0.0, 1.0): pin.JointModelRZ,
    }
    if joint.axis in named:
        return named[joint.axis]()
    return pin.JointModelRevoluteUnaligned(np.array(joint.axis))


def _inertia(link: Link) -> pin.Inertia:
    xx, yy, zz, xy, xz, yz = link.inertia_kgm2
    return pin.Inertia(link.mass_kg, np.array(link.com_m), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


class Kinematics:
    """Kinematics of one arm. Not thread-safe: it holds one Pinocchio workspace.

    Attributes:
        description: Source of the model.
        lower, upper: (dof,) position limits, rad.
        velocity: (dof,) velocity limits, rad/s.
        home: (dof,) the description's home posture, rad.
    """

    def __init__(self, description: RobotDescription) -> None:
        self.description = description
        self.model = build_model(description)
        self._data = self.model.createData()
        self._frame = self.model.getFrameId("P")
        self.lower: Array = np.array([j.lower_rad for j in description.joints])
        self.upper: Array = np.array([j.upper_rad for j in description.joints])
        self.velocity: Array = np.array([j.velocity_rad_s for j in description.joints])
        self.home: Array = np.array(description.home_q)
        self._ridge = 1e-9 * np.eye(6)

    def fk(self, q: Array) -> Pose:
        """Return the pose of P in B at joint positions `q` (dof,), rad."""
        pin.forwardKinematics(self.model, self._data, self._checked(q))
        placement = pin.updateFramePlacement(self.model, self._data, self._frame)
        x, y, z, qx, qy, qz, qw = pin.SE3ToXYZQUAT(placement).tolist()
        sign = 1.0 if qw >= 0.0 else -1.0
        return known_pose(np.array([x, y, z]), np.array([sign * qw, sign * qx, sign * qy, sign * qz]))

    def place(self, q: Array) -> tuple[Array, Array]:
        """Return position (3,) m and rotation (3, 3) of P in B at `q` (dof,) rad."""
        pin.forwardKinematics(self.model, self._data, self._checked(q))
        placement = pin.updateFramePlacement(self.model, self._data, self._frame)
        return placement.translation.copy(), placement.rotation.copy()

    def jacobian(self, q: Array) -> Array:
        """Return the Jacobian (6, dof) of P: linear (m/s) over angular (rad/s) velocity in B, per rad/s."""
        pin.computeJointJacobians(self.model, self._data, self._checked(q))
        pin.updateFramePlacement(self.model, self._data, self._frame)
        j = pin.getFrameJacobian(self.model, self._data, self._frame, pin.LOCAL_WORLD_ALIGNED)
        return np.asarray(j, dtype=np.float64)

    def link_placements(self, q: Array) -> tuple[Array, Array]:
        """Return every link frame in B at `q`: rotations (dof, 3, 3) and origins (dof, 3), m."""
        pin.forwardKinematics(self.model, self._data, self._checked(q))
        frames = list(self._data.oMi)[1:]
        return np.array([m.rotation for m in frames]), np.array([m.translation for m in frames])

    def path_step(
        self, position_m: Array, rotation: Array, q: Array, twist_B: Array, posture_gain: float = 0.0
    ) -> tuple[Array, Array, float]:
        """Compute correction and tangent for path following from one Jacobian at `q`; joint limits are ignored.

        The correction is one Newton step, which converges quadratically: 1 mm becomes about a micrometre.

        Args:
            position_m, rotation: The target of P, (3,) m and (3, 3).
            q: (dof,) rad, near the target.
            twist_B: (6,) linear and angular change of the target per metre of path, in B.
            posture_gain: Null-space pull towards home, per metre of path.

        Returns:
            Newton correction (dof,) rad; dq/ds (dof,) rad/m of twist and posture pull; distance of P from the target
            (largest component in m and rad).
        """
        model, data = self.model, self._data
        pin.computeJointJacobians(model, data, q)
        frame = pin.updateFramePlacement(model, data, self._frame)
        j = pin.getFrameJacobian(model, data, self._frame, pin.LOCAL_WORLD_ALIGNED)
        right = np.zeros((6, 2 if posture_gain == 0.0 else 3), order="F")
        right[:3, 0] = position_m - frame.translation
        right[3:, 0] = pin.log3(rotation @ frame.rotation.T)
        right[:, 1] = twist_B
        error = float(np.abs(right[:, 0]).max())
        if posture_gain != 0.0:
            pull = posture_gain * (self.home - q)
            right[:, 2] = j @ pull
        x = j.T @ scipy.linalg.lapack.dgesv(j @ j.T + self._ridge, right, overwrite_a=1, overwrite_b=1)[2]
        if posture_gain != 0.0:
            x[:, 1] += pull - x[:, 2]
        return x[:, 0], x[:, 1], error

    def ik(
        self, pose_B_P: Pose, q_seed: npt.ArrayLike, *, posture_weight: float = 0.5, what: str = "reaching a pose"
    ) -> Array:
        """Solve inverse kinematics by damped least squares with joint limits and a null-space posture task.

        The Levenberg-Marquardt damping vanishes with the error (Sugihara 2011). A joint that would leave its range is
        clamped and removed from the step. If the seed fails, home and home turned towards the target are tried.

        Args:
            pose_B_P: Target pose of P in B.
            q_seed: (dof,) rad, start of the iteration; the solution is on its branch.
            posture_weight: 0..1, fraction of the distance to home travelled in the null space per iteration.
            what: Name of the motion for the error message.

        Returns:
            (dof,) rad, within the limits, exact to 1e-8 m and 1e-7 rad.

        Raises:
            MotionRefused: No solution within the joint limits; gives the remaining distance and the blocking joint.
        """
        seed = self._checked(np.asarray(q_seed, dtype=np.float64))
        best = ""
        least = np.inf
        for start in (seed, self.home, self.home_towards(pose_B_P.position_m)):
            q, error, blocked = self._solve(pose_B_P, np.clip(start, self.lower, self.upper), posture_weight)
            if error == 0.0:
                return q
            if error < least:
                least = error
                missing = np.linalg.norm(self.place(q)[0] - pose_B_P.position_m)
                where = np.array2string(pose_B_P.position_m, precision=3)
                best = f"P at {where} m in B cannot be reached, the nearest is {missing * 1e3:.1f} mm away"
                best += f" with {blocked}" if blocked else " (out of reach or too near a singularity)"
        raise MotionRefused(what, best)

    def home_towards(self, position_m: Array) -> Array:
        """Return home (dof,), rad, with the first joint turned towards a position (3,) in B as far as it can."""
        turned, home_P = self.home.copy(), self.place(self.home)[0]
        turn = np.arctan2(position_m[1], position_m[0]) - np.arctan2(home_P[1], home_P[0])
        turned[0] = np.clip(turned[0] + turn, self.lower[0], self.upper[0])
        return turned

    def _solve(self, pose: Pose, q: Array, weight: float) -> tuple[Array, float, str]:
        target = pose.rotation
        dof = len(q)
        blocked = ""
        norm = np.inf
        for _ in range(_MAX_ITERATIONS):
            before = q.copy()
            j = self.jacobian(q)
            frame = self._data.oMf[self._frame]
            error = np.concatenate([pose.position_m - frame.translation, pin.log3(target @ frame.rotation.T)])
            near_P = float(np.linalg.norm(error[:3]))
            near_R = float(np.linalg.norm(error[3:]))
            norm = near_P + 0.1 * near_R
            reached = near_P < _POSITION_TOLERANCE_M and near_R < _ROTATION_TOLERANCE_RAD
            damping = 1e-9 + 0.01 * min(norm * norm, 1.0)
            free = np.ones(dof, dtype=bool)
            pull = weight * (self.home - q)
            for _ in range(dof):
                jf = j[:, free]
                solved = np.linalg.solve(jf @ jf.T + damping * np.eye(6), np.stack([error, jf @ pull[free]], axis=1))
                back = jf.T @ solved
                dq = np.zeros(dof)
                dq[free] = back[:, 0] + pull[free] - back[:, 1]
                dq *= min(1.0, _MAX_STEP_RAD / max(float(np.abs(dq).max()), 1e-12))
                out = free & (((q + dq > self.upper) & (dq > 0)) | ((q + dq < self.lower) & (dq < 0)))
                if not out.any():
                    break
                # Active set: clamp the joint to its limit and solve for the remaining joints.
                i = int(np.flatnonzero(out)[0])
                limit = self.upper[i] if dq[i] > 0 else self.lower[i]
                blocked = f"{self.description.joints[i].name} at its limit of {limit:.3f} rad"
                error = error - j[:, i] * (limit - q[i])
                q[i] = limit
                free[i] = False
            else:
                dq = np.zeros(dof)
            if free.all():
                blocked = ""
            if reached and (blocked or float(np.abs(dq).max()) < 1e-3):
                return before, 0.0, ""
            q = np.clip(q + dq, self.lower, self.upper)
        return q, max(norm, 1e-12), blocked

    def _checked(self, q: Array) -> Array:
        if q.shape != self.home.shape:
            raise ParamError("q", q.shape, f"an array of shape {self.home.shape}")
        return q
