"""From joint setpoints to servo commands: cubic Hermite between setpoints, feed-forward, and braking to a hold."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from backends.mujoco.arm_model import DAMPING_PER_STIFFNESS_S, JOINT_DAMPING, STIFFNESS_NM_RAD
from backends.mujoco.model import STEPS, Handles
from glotouch_bt.robot import Array, JointSetpoint, ParamError, RobotDescription

BRAKE_REACH_M = 0.8  # the hand's distance from the axes, to turn a Cartesian deceleration into a joint one
VELOCITY_SLACK = 1.02  # of the implied velocity between setpoints, for rounding


def hermite(period_s: float, steps: int) -> tuple[Array, Array]:
    """Position and velocity bases (steps, 4) on (q0, dq0, q1, dq1), at the START of each of the period's steps.

    Standard cubic Hermite basis; the command of a step acts from its start, so the period's end is the next one's start.
    """
    s, t = np.arange(steps) / steps, period_s
    position = np.stack(
        [2 * s**3 - 3 * s**2 + 1, t * (s**3 - 2 * s**2 + s), -2 * s**3 + 3 * s**2, t * (s**3 - s**2)], axis=1
    )
    velocity = np.stack(
        [(6 * s**2 - 6 * s) / t, 3 * s**2 - 4 * s + 1, (6 * s - 6 * s**2) / t, 3 * s**2 - 2 * s], axis=1
    )
    return position, velocity


class Servo:
    """Keeps the last setpoint and turns the next one into one servo command a step.

    MuJoCo's position servo gives kp (ctrl - q) - kv dq; with
    ctrl = q + ((kv + damping) dq + M ddq) / kp the joints follow q without lag (M includes the armature).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        handles: Handles,
        description: RobotDescription,
        period_s: float,
        stop_acceleration_m_s2: float,
    ) -> None:
        self._model, self._data, self._dof = model, data, handles.arm_dof
        joints = description.joints
        self._lower = np.array([j.lower_rad for j in joints]) - 1e-9
        self._upper = np.array([j.upper_rad for j in joints]) + 1e-9
        self._fastest = np.array([j.velocity_rad_s for j in joints])
        self._names = [j.name for j in joints]
        self._kp = np.array(STIFFNESS_NM_RAD)
        self._per_kp = 1.0 / self._kp
        self._lead = DAMPING_PER_STIFFNESS_S + JOINT_DAMPING / self._kp
        self._period = period_s
        self._brake_step = stop_acceleration_m_s2 / BRAKE_REACH_M * period_s
        self._position_basis, self._velocity_basis = hermite(period_s, STEPS)
        self._along = (np.arange(STEPS) / STEPS)[:, None]
        n = description.dof
        self._knots = np.zeros((4, n))  # q0, dq0, q1, dq1
        self._ddq = np.zeros(n)
        self._vector, self._product = np.zeros(model.nv), np.zeros(model.nv)
        self._torque = np.zeros(n)
        self._still = False

    @property
    def q(self) -> Array:
        """(dof,) the setpoint reached at the end of the last period, rad."""
        return self._knots[2]

    @property
    def moving(self) -> bool:
        """True while the setpoint has a velocity."""
        return bool(self._knots[3].any())

    def reset(self, q: Array) -> None:
        """Stand at `q` (dof,) from now on, at once."""
        self._knots[0] = self._knots[2] = q
        self._knots[1] = self._knots[3] = 0.0
        self._ddq[:] = 0.0

    def load(self, torque_Nm: Array) -> None:
        """Constant feed-forward torque (dof,) that carries a payload's weight."""
        self._torque = torque_Nm * self._per_kp

    def check(self, setpoint: JointSetpoint) -> tuple[Array, Array, Array]:
        """The setpoint as arrays, if it is sane.

        Raises:
            ParamError: Wrong shape, not finite, or beyond a joint's position or velocity limit.
        """
        q, dq, ddq = (np.asarray(v, dtype=np.float64) for v in (setpoint.q, setpoint.dq, setpoint.ddq))
        shape = self.q.shape
        for name, value in (("q", q), ("dq", dq), ("ddq", ddq)):
            if value.shape != shape:
                raise ParamError(f"setpoint.{name}", value.shape, f"an array of shape {shape}")
        if not math.isfinite(q.sum() + dq.sum() + ddq.sum()):
            raise ParamError("setpoint", (q.tolist(), dq.tolist(), ddq.tolist()), "finite")
        if (q < self._lower).any() or (q > self._upper).any():
            self._refuse("q", q, self._lower, self._upper, "rad")
        if (np.abs(dq) > self._fastest).any():
            self._refuse("dq", dq, -self._fastest, self._fastest, "rad/s")
        implied = (q - self.q) / self._period
        if (np.abs(implied) > VELOCITY_SLACK * self._fastest).any():
            self._refuse("q step / period", implied, -self._fastest, self._fastest, "rad/s")
        return q, dq, ddq

    def _refuse(self, what: str, value: Array, lower: Array, upper: Array, unit: str) -> None:
        i = int(np.argmax(np.maximum(lower - value, value - upper)))
        raise ParamError(
            f"setpoint.{what}[{self._names[i]}]", float(value[i]), f"within {lower[i]:.4f} .. {upper[i]:.4f} {unit}"
        )

    def _brake(self) -> tuple[Array, Array, Array]:
        """The next setpoint of a straight, even deceleration to rest (in joint space)."""
        q, dq = self._knots[2], self._knots[3]
        fastest = float(np.abs(dq).max())
        if fastest == 0.0:
            return q, dq, np.zeros_like(q)
        slower = dq * max(0.0, 1.0 - self._brake_step / fastest)
        return q + 0.5 * self._period * (dq + slower), slower, (slower - dq) / self._period

    def plan(self, target: tuple[Array, Array, Array] | None, ctrl: Array) -> None:
        """Fill ctrl (steps, dof) for the coming period: towards the target, or braking to rest if None."""
        k = self._knots
        if target is None and not k[3].any() and not k[1].any() and not self._ddq.any():
            ctrl[:] = k[2] + self._torque
            k[0] = k[2]
            return
        q, dq, ddq = self._brake() if target is None else target
        k0, k1 = k[2].copy(), k[3].copy()
        k[0], k[1], k[2], k[3] = k0, k1, q, dq
        first, last = self._inertia(self._ddq), self._inertia(ddq)
        np.matmul(self._velocity_basis, k, out=ctrl)
        ctrl *= self._lead
        ctrl += self._position_basis @ k
        ctrl += first + self._along * (last - first)
        ctrl += self._torque
        self._ddq[:] = ddq

    def _inertia(self, ddq: Array) -> Array:
        """M ddq / kp, with the present inertia matrix."""
        self._vector[self._dof] = ddq
        mujoco.mj_mulM(self._model, self._data, self._product, self._vector)
        return self._product[self._dof] * self._per_kp
