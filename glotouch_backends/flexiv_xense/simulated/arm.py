"""The simulated arm: the part of the vendor's firmware that moves the arm and reads its sensors.

ASSUMED, because the vendor does not document it: the latencies and decelerations in this file; that the contact wrench
is limited by bounding the motors' wrench at the tool (`_pressing`), which does not bound the first milliseconds of an
impact; and that an arm whose client is gone brakes after LINK_LOST_S.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np

from glotouch_backends.flexiv_xense.simulated.kinematics import ControllerKinematics, inverse, rotation_between
from glotouch_backends.flexiv_xense.simulated.trajectory import Trajectory, cubic_extremes, shortest
from glotouch_backends.mujoco.control import BRAKE_REACH_M
from glotouch_backends.mujoco.model import DAMPING_PER_STIFFNESS_S, JOINT_DAMPING, STEP_S, BuiltWorld
from glotouch_backends.mujoco.sensing import GRAVITY_M_S2, WristSensor, up_in
from glotouch_bt.robot import Array, Pose, cross_matrix, quat_to_matrix
from glotouch_bt.robot.scene import stream

STOP_RAD_S2 = 2.0 / BRAKE_REACH_M
"""Deceleration of a stop: 2 m/s2 at the hand. ASSUMED."""
LINK_LOST_S = 0.1
"""Time from losing the client to braking. ASSUMED."""
FILTER_S = 0.010
"""Time constant of the filtered wrench. ASSUMED."""
OFFSET_SD = np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
"""Standard deviation of the reading of a sensor that has not been zeroed, N and Nm. ASSUMED."""
PARTED_SHARE = 0.25
"""Below this share of the maximum contact wrench the contact counts as ended. ASSUMED."""
PARTED_STEPS = 100
"""Steps after the end of the contact until the motors' wrench is no longer bounded. ASSUMED."""
STILL_RAD_S = 1e-3
"""The arm stands still while every joint is below this speed. ASSUMED."""
NOMINAL_STIFFNESS = np.array([10000.0, 10000.0, 10000.0, 1500.0, 1500.0, 1500.0])
"""Nominal Cartesian stiffness, N/m and Nm/rad. Source: vendor data of the Rizon 4."""


class Sample(NamedTuple):
    """Readings of one millisecond.

    Attributes:
        step: Number of solver steps since the world began.
        row: (nsensordata,) MuJoCo's sensor data.
        wrench_S, filtered_S: (6,) wrench on everything beyond the flange, in S about S, tared and without the tool's
            weight; unfiltered and filtered.
    """

    step: int
    row: Array
    wrench_S: Array
    filtered_S: Array


@dataclass(frozen=True)
class Load:
    """The load on the flange as configured in the controller.

    Attributes:
        mass_kg: Mass.
        com_E_m: (3,) centre of mass in E.
        pose_E_T: The tool centre point.
    """

    mass_kg: float
    com_E_m: Array
    pose_E_T: Pose

    @cached_property
    def at_T(self) -> Array:
        """Matrix (6, 6) that moves a wrench from S to the tool centre point: the torque becomes m - r x f."""
        move = np.eye(6)
        move[3:, :3] = -cross_matrix(self.pose_E_T.position_m)
        return move

    @cached_property
    def in_T(self) -> Array:
        """Matrix (6, 6) that moves a wrench from S to the tool centre point and writes it in the tool's axes."""
        turn = np.zeros((6, 6))
        turn[:3, :3] = turn[3:, 3:] = self.pose_E_T.rotation.T
        return np.asarray(turn @ self.at_T)


FLANGE = Load(0.0, np.zeros(3), Pose(np.zeros(3)))


class SimulatedArm:
    """Trajectory, servo, wrench and tare of the simulated arm. The world steps it.

    Args:
        built: The world.
    """

    def __init__(self, built: BuiltWorld) -> None:
        model, data, handles, description = built.model, built.data, built.handles, built.description
        self.description = description
        self._model, self._data, self._h, self.sensors = model, data, handles, handles.sensors
        self.trajectory = Trajectory(np.array(data.qpos[handles.arm_qpos]))
        self.kinematics = ControllerKinematics(model, handles)
        kp = np.array([j.servo_stiffness_Nm_rad for j in description.joints])
        self._per_kp, self._lead = 1.0 / kp, DAMPING_PER_STIFFNESS_S + JOINT_DAMPING / kp
        self._vector, self._product = np.zeros(model.nv), np.zeros(model.nv)
        self._jacobian = np.zeros((6, model.nv))
        self._hand = description.gripper.mass_and_com_E()
        self._wrist = WristSensor(description, built.conditions, built.seed, steps=1, proof=built.proof)
        self._offset_S = OFFSET_SD * stream(built.seed, "unzeroed").standard_normal(6)
        self._bias = np.zeros(6)
        self._taring: list[Array] | None = None
        self.load = FLANGE
        self._carry: Array | None = None
        self._max_wrench: Array | None = None
        self._per_most = (0.0, 0.0)
        self._bounding = 0
        self.reference_q = self.trajectory.q
        self._lost_steps: int | None = None
        first = np.array(data.sensordata)
        self._wrist.fill(-first[self.sensors.force.start : self.sensors.torque.stop])
        self.sample = Sample(0, first, np.zeros(6), np.zeros(6))
        self.sense(0, first)

    # --- requests of the control box --------------------------------------------------------------------------------

    def set_load(self, load: Load) -> None:
        """Set the load: its weight is subtracted from the wrench and carried by the motors from now on."""
        self.load = load
        self._wrist.set_payload(load.mass_kg, self.description.gripper.pose_E_P.inverse().apply(load.com_E_m))
        self._carry = None
        self.carry()

    def go_to_pose(self, pose_B_T: Pose, twist_B: Array, limits: tuple[float, float, float, float]) -> bool:
        """Move to a pose of the tool centre point with its twist (6,); return False if it is out of reach.

        `limits` are the linear and angular velocity, then the linear and angular acceleration.
        """
        now, E_P = self.trajectory, self.description.gripper.pose_E_P
        pose_T_P = self.load.pose_E_T.inverse() @ E_P
        pose_B_P = pose_B_T @ pose_T_P
        lever = pose_B_T.rotation @ pose_T_P.position_m
        twist_P = np.concatenate([twist_B[:3] + np.cross(twist_B[3:], lever), twist_B[3:]])
        _, _, j_now = self.kinematics.at(now.q)
        found = self.kinematics.solve(pose_B_P, now.q, self.reference_q, 0.01)
        if found is None:
            return False
        q, j = found
        mean = j_now @ (q - now.q)
        v0 = j_now @ now.dq
        null = (q - now.q) - inverse(j_now) @ mean
        dq = inverse(j) @ twist_P
        linear_vel, angular_vel, linear_acc, angular_acc = limits

        def fits(time_s: float) -> bool:
            fastest, hardest = cubic_extremes(mean, v0, twist_P, time_s)
            asked = float(np.linalg.norm(twist_P[:3])), float(np.linalg.norm(twist_P[3:]))
            return bool(
                np.linalg.norm(fastest[:3]) <= max(linear_vel, asked[0]) + 1e-9
                and np.linalg.norm(fastest[3:]) <= max(angular_vel, asked[1]) + 1e-9
                and np.linalg.norm(hardest[:3]) <= linear_acc
                and np.linalg.norm(hardest[3:]) <= angular_acc
            )

        time_s = shortest(fits)
        now.go(q, dq + (null / time_s if twist_B.any() else 0.0), time_s)
        return True

    @property
    def stopped(self) -> bool:
        """True if the arm stands still and no motion is commanded."""
        return self.trajectory.at_rest and float(np.abs(self.sample.row[self.sensors.dq]).max()) < STILL_RAD_S

    def limit_wrench(self, most: Array | None) -> None:
        """Bound the components (6,) of the contact wrench, N and Nm, from now on; None removes the bound."""
        self._max_wrench = most
        self._bounding = 0
        if most is not None:
            self._per_most = max(float(most[:3].min()), 1e-6) ** -2, max(float(most[3:].min()), 1e-6) ** -2

    def brake(self) -> None:
        """Brake to rest."""
        self.trajectory.brake(STOP_RAD_S2)

    def lose_link(self) -> None:
        """Brake after LINK_LOST_S: the client is gone."""
        self._lost_steps = round(LINK_LOST_S / STEP_S)

    def find_link(self) -> None:
        """Cancel the pending braking: a client is connected."""
        self._lost_steps = None

    def begin_zeroing(self) -> None:
        """Start collecting samples for a tare."""
        self._taring = []

    def end_zeroing(self) -> None:
        """Subtract the mean of the collected samples from now on."""
        if self._taring:
            self._bias = np.mean(self._taring, axis=0)
        self._taring = None

    # --- every millisecond ------------------------------------------------------------------------------------------

    def control(self, ctrl: Array) -> None:
        """Fill the servo commands (dof,) of the next step, by the law of `mujoco.control.Servo`."""
        if self._lost_steps is not None:
            self._lost_steps -= 1
            if self._lost_steps == 0:
                self.brake()
        q, dq, ddq = self.trajectory.advance()
        if self._bounding and self._max_wrench is not None:
            ctrl[:] = self._pressing(q, self._max_wrench)
        else:
            ctrl[:] = q
            ctrl += self._lead * dq
            if np.count_nonzero(ddq):
                self._vector[self._h.arm_dof] = ddq
                mujoco.mj_mulM(self._model, self._data, self._product, self._vector)
                ctrl += self._product[self._h.arm_dof] * self._per_kp
        if self._carry is not None:
            ctrl += self._carry

    def sense(self, step: int, row: Array) -> None:
        """Process the sensor row of the last step; `row` is kept."""
        s = self.sensors
        up = up_in(row[s.quat])
        true = -row[s.force.start : s.torque.stop]
        measured = self._wrist.measure(true[None, :], up)[0] + self._offset_S
        if self._taring is not None:
            self._taring.append(measured)
        wrench = measured - self._bias
        last = self.sample.filtered_S
        filtered = last + (STEP_S / FILTER_S) * (wrench - last)
        self.sample = Sample(step, row, wrench, filtered)
        if self._max_wrench is not None:
            at_T = self.load.at_T @ wrench
            f, m = at_T[:3], at_T[3:]
            share = max(float(f @ f) * self._per_most[0], float(m @ m) * self._per_most[1])
            if share > 1.0:
                self._bounding = PARTED_STEPS
            elif self._bounding and share < PARTED_SHARE**2:
                self._bounding -= 1

    def carry(self) -> None:
        """Update the motors' feed-forward for the load beyond the hand; call once a control period."""
        mass, com = self._hand
        extra = self.load.mass_kg - mass
        moment = self.load.mass_kg * self.load.com_E_m - mass * com
        if abs(extra) < 1e-9 and float(np.abs(moment).max()) < 1e-9:
            self._carry = None
            return
        h, d = self._h, self._data
        origin, rotation = d.site_xpos[h.sensor_site], d.site_xmat[h.sensor_site].reshape(3, 3)
        mujoco.mj_jac(self._model, d, self._jacobian[:3], self._jacobian[3:], origin, h.hand_bodies.start)
        # At the flange, the weight m g at the centre of mass c is m g z upwards and the torque (m c) x g z.
        arm = rotation @ moment
        j = self._jacobian[:, h.arm_dof]
        self._carry = GRAVITY_M_S2 * (extra * j[2] + arm[1] * j[3] - arm[0] * j[4]) * self._per_kp

    def _pressing(self, q: Array, most: Array) -> Array:
        """Return servo commands (dof,) towards the setpoint `q` (dof,) with at most the contact wrench `most` (in B, at
        P).

        A spring of nominal stiffness pulls P to the setpoint's pose, with each component of its wrench bounded. The
        damper acts against motion, and the command of the redundant joint is unchanged.
        """
        row, k = self.sample.row, self.kinematics
        goal, turned, _ = k.at(q)
        j = k.at(row[self.sensors.q])[2]
        away = rotation_between(turned, quat_to_matrix(row[self.sensors.quat]))
        spring = NOMINAL_STIFFNESS * np.concatenate([goal - row[self.sensors.position], away])
        stretch = (q - row[self.sensors.q]) / self._per_kp
        redundant = stretch - j.T @ (inverse(j).T @ stretch)
        return np.asarray(row[self.sensors.q] + (j.T @ np.clip(spring, -most, most) + redundant) * self._per_kp)
