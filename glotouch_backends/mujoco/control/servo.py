"""Servo commands from joint setpoints: cubic Hermite interpolation, feed-forward, and braking to rest."""

from __future__ import annotations

import mujoco
import numpy as np

from glotouch_backends.mujoco.model import DAMPING_PER_STIFFNESS_S, JOINT_DAMPING, STEPS, Handles
from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, JointSetpoint, ParamError, RobotDescription

BRAKE_REACH_M = 0.8
"""Distance of the hand from the axes that converts a Cartesian deceleration into a joint deceleration. Source: ours."""
BRAKE_S = 0.003
"""Time constant of the joints' speed during a safety stop, as far as the motors' torque allows. Source: ours."""
MAX_ACCELERATION_RAD_S2 = 1e3
"""Refuse a larger feed-forward acceleration. Source: ours."""
VELOCITY_SLACK = 1.02
"""Implied over allowed velocity between two setpoints, for rounding. Source: ours."""


def hermite(period_s: float, steps: int) -> tuple[Array, Array]:
    """Return position and velocity bases (steps, 4) on (q0, dq0, q1, dq1), at the START of each step of a period.

    Standard cubic Hermite basis. A step's command acts from its start, so the period's end is the next one's start.
    """
    s, t = np.arange(steps) / steps, period_s
    position = np.stack(
        [2 * s**3 - 3 * s**2 + 1, t * (s**3 - 2 * s**2 + s), -2 * s**3 + 3 * s**2, t * (s**3 - s**2)], axis=1
    )
    velocity = np.stack(
        [(6 * s**2 - 6 * s) / t, 3 * s**2 - 4 * s + 1, (6 * s - 6 * s**2) / t, 3 * s**2 - 2 * s], axis=1
    )
    return position, velocity


@compiled("f8[:, ::1]", "f8[::1]", "f8", "f8[:, ::1]", "f8[:, ::1]")
def _in_range(asked: Array, last: Array, period_s: float, middle: Array, half: Array) -> bool:
    """Fill the last row of `asked` (4, dof), the velocity from `last` (dof,); return True if no value is too far out.

    Rows of all tables: q, dq, ddq, implied velocity. A value may be `half` away from `middle`; NaN may not.
    """
    good = True
    for j in range(asked.shape[1]):
        asked[3, j] = (asked[0, j] - last[j]) / period_s
        for i in range(4):
            good = good and abs(asked[i, j] - middle[i, j]) <= half[i, j]
    return good


class Servo:
    """Interpolate from the last setpoint to the next one, with one servo command a step.

    MuJoCo's position servo gives kp (ctrl - q) - kv dq; with
    ctrl = q + ((kv + damping) dq + M ddq) / kp the joints follow q without lag (M includes the armature).
    With `lag_s` less feed-forward they follow that much later: at a constant speed v by v lag_s.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        handles: Handles,
        description: RobotDescription,
        period_s: float,
        stop_acceleration_m_s2: float,
        lag_s: float = 0.0,
    ) -> None:
        self._model, self._data = model, data
        self._dof, self._arm_qpos = handles.arm_dof, handles.arm_qpos
        self._diagonal = (model.M_rowadr + model.M_rownnz - 1)[handles.arm_dof]  # the last entry of each row
        joints = description.joints
        n = description.dof
        lower, upper = np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints])
        fastest = np.array([j.velocity_rad_s for j in joints])
        self._middle = np.stack([0.5 * (lower + upper), np.zeros(n), np.zeros(n), np.zeros(n)])
        self._half = np.stack(
            [0.5 * (upper - lower) + 1e-9, fastest, np.full(n, MAX_ACCELERATION_RAD_S2), VELOCITY_SLACK * fastest]
        )
        self._names = [j.name for j in joints]
        kp = np.array([j.servo_stiffness_Nm_rad for j in joints])
        self._per_kp = 1.0 / kp
        self._lead = DAMPING_PER_STIFFNESS_S + JOINT_DAMPING / kp
        self._ahead = self._lead - lag_s
        self._period = period_s
        self._brake_step = stop_acceleration_m_s2 / BRAKE_REACH_M * period_s
        along = (np.arange(STEPS) / STEPS)[:, None]
        # One product gives all commands: position basis on the knots, velocity basis on the scaled knots, ramped
        # torques.
        self._basis = np.hstack([*hermite(period_s, STEPS), 1.0 - along, along, np.ones((STEPS, 1))])
        self._terms = np.zeros((11, n))
        self._knots: Array = self._terms[:4]  # q0, dq0, q1, dq1
        self._scaled, self._torques = self._terms[4:8], (self._terms[8], self._terms[9])
        self._asked = np.zeros((4, n))
        self._ddq = np.zeros(n)
        self._vector, self._product = np.zeros(model.nv), np.zeros(model.nv)
        self._of_arm = self._vector[self._dof], self._product[self._dof]

    @property
    def q(self) -> Array:
        """Setpoint (dof,) at the end of the last period, rad."""
        return np.asarray(self._knots[2])

    @property
    def rate(self) -> Array:
        """Mean rate (dof,) of the setpoint over the present period, rad/s."""
        return np.asarray((self._knots[2] - self._knots[0]) / self._period)

    def reset(self, q: Array) -> None:
        """Set the setpoint to `q` (dof,) at rest, without a ramp."""
        self._knots[0] = self._knots[2] = q
        self._knots[1] = self._knots[3] = 0.0
        self._ddq[:] = 0.0

    def brake(self, ctrl: Array) -> None:
        """Fill ctrl (dof,) for one step: brake every joint as hard as its motor allows, wherever it is."""
        q, dq = self._data.qpos[self._arm_qpos], self._data.qvel[self._dof]
        inertia = self._data.M[self._diagonal]
        ctrl[:] = q - np.maximum(inertia / BRAKE_S * self._per_kp - self._lead, 0.0) * dq + self._terms[10]

    def load(self, torque_Nm: Array) -> None:
        """Set the constant feed-forward torque (dof,) that carries a payload's weight."""
        self._terms[10] = torque_Nm * self._per_kp

    def check(self, setpoint: JointSetpoint) -> tuple[Array, Array, Array]:
        """Return the setpoint as arrays (q, dq, ddq) if it is valid.

        Raises:
            ParamError: Wrong shape, not finite, or beyond a joint's position or velocity limit.
        """
        asked = self._asked
        try:
            asked[0], asked[1], asked[2] = setpoint.q, setpoint.dq, setpoint.ddq
        except (ValueError, TypeError) as e:
            raise ParamError("setpoint", setpoint, f"arrays of shape {self.q.shape}") from e
        if not _in_range(asked, self._knots[2], self._period, self._middle, self._half):
            row, i = (int(v[0]) for v in np.nonzero(~(np.abs(asked - self._middle) <= self._half)))
            middle, half = self._middle[row, i], self._half[row, i]
            what, unit = (("q", "rad"), ("dq", "rad/s"), ("ddq", "rad/s2"), ("(q - last q) / period", "rad/s"))[row]
            rule = f"finite and within {middle - half:.4f} .. {middle + half:.4f} {unit}"
            raise ParamError(f"setpoint.{what}[{self._names[i]}]", float(asked[row, i]), rule)
        return asked[0], asked[1], asked[2]

    def _brake(self) -> tuple[Array, Array, Array]:
        """Return the next setpoint of a uniform deceleration to rest, straight in joint space."""
        q, dq = self._knots[2], self._knots[3]
        fastest = float(np.abs(dq).max())
        if fastest == 0.0:
            return q, dq, np.zeros_like(q)
        slower = dq * max(0.0, 1.0 - self._brake_step / fastest)
        return q + 0.5 * self._period * (dq + slower), slower, (slower - dq) / self._period

    def plan(self, target: tuple[Array, Array, Array] | None, ctrl: Array) -> None:
        """Fill ctrl (steps, dof) for the next period: towards the target, or braking to rest if it is None."""
        k, terms = self._knots, self._terms
        if target is None and not np.count_nonzero(k[3]):
            if not np.count_nonzero(self._ddq):
                k[0], k[1] = k[2], 0.0
                ctrl[:] = k[2] + terms[10]
                return
            target = (k[2], k[3], np.zeros_like(k[2]))
        q, dq, ddq = self._brake() if target is None else target
        k[:2] = k[2:]
        k[2], k[3] = q, dq
        np.multiply(k, self._ahead, out=self._scaled)
        # M ddq / kp at both ends, with the present inertia matrix (the armature is in M)
        vector, product = self._of_arm
        for torque, acceleration in zip(self._torques, (self._ddq, ddq), strict=True):
            vector[:] = acceleration
            mujoco.mj_mulM(self._model, self._data, self._product, self._vector)
            np.multiply(product, self._per_kp, out=torque)
        np.matmul(self._basis, terms, out=ctrl)
        self._ddq[:] = ddq
