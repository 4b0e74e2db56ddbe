"""The simulated robot: one `cycle` is ten MuJoCo steps with little Python between them."""

from __future__ import annotations

import mujoco
import numpy as np

from glotouch_backends.mujoco.control import (
    PAYLOAD_S,
    HardLimitGuard,
    JawReports,
    JawServo,
    PendingPayload,
    PendingTare,
    Servo,
    check_sane,
)
from glotouch_backends.mujoco.model import STEP_S, STEPS, BuiltWorld
from glotouch_backends.mujoco.sensing import GRAVITY_M_S2, PoseReports, Tactile, WristSensor, up_in
from glotouch_backends.mujoco.simulation import CollisionFilter, ControlTrace, SnapshotStore, TrueForce
from glotouch_bt.compiled import compiled
from glotouch_bt.robot import (
    Array,
    BackendError,
    Command,
    GripperState,
    Limits,
    Observation,
    ParamError,
    Request,
    Robot,
    Snapshot,
    Tare,
    Ticket,
)

REST_RAD_S = 1e-3
"""A stopped arm stands still below this speed of every joint. Source: ours."""
MAX_HELD_DISTANCE_M = 0.02
"""The probe counts as held while its handle is within this distance of P. Source: ours."""


@compiled("f8[:, :, ::1]", "f8[::1]", "f8[:]", "i8")
def forces_2(external: Array, probe: Array, pads: Array, hand: int) -> Array:
    """Return the squares (steps,) of the contact force, N^2, on the hand, and on the probe while it is held.

    Args:
        external: (steps, bodies, 6) torque and force on the hand's bodies, and from the body `hand` on on the probe's.
        probe, pads: (3,) the probe's handle and the pads' mid-point in B at the end of the period.
        hand: Number of the hand's bodies.
    """
    x, y, z = probe[0] - pads[0], probe[1] - pads[1], probe[2] - pads[2]
    bodies = external.shape[1] if x * x + y * y + z * z < MAX_HELD_DISTANCE_M**2 else hand
    squares = np.zeros(len(external))
    for step in range(len(external)):
        x = y = z = 0.0
        for body in range(bodies):
            x += external[step, body, 3]
            y += external[step, body, 4]
            z += external[step, body, 5]
        squares[step] = x * x + y * y + z * z
    return squares


@compiled("f8[:, :]", "f8[:, :]", "f8[:]", "f8[:, :]", "given f8[:]", "f8")
def carrying_torques(anchors: Array, axes: Array, origin: Array, rotation: Array, com: Array, weight_N: float) -> Array:
    """Return the torques (dof,) Nm of hinges that carry a weight.

    Args:
        anchors, axes: (dof, 3) a point and the direction of each hinge in B, whose z axis points up.
        origin, rotation: Pose of P in B.
        com: (3,) centre of mass in P.
        weight_N: Its weight.
    """
    x, y = origin[0], origin[1]
    for k in range(3):
        x += rotation[0, k] * com[k]
        y += rotation[1, k] * com[k]
    out = np.zeros(len(anchors))
    for i in range(len(out)):  # the vertical speed of the weight for a unit speed of the hinge
        out[i] = weight_N * (axes[i, 0] * (y - anchors[i, 1]) - axes[i, 1] * (x - anchors[i, 0]))
    return out


class MujocoRobot(Robot):
    """See `Robot`. Created by `MujocoBackend.open`; only the referee may read its truth."""

    def __init__(self, built: BuiltWorld, limits: Limits, traced: bool = False) -> None:
        description, conditions, seed = built.description, built.conditions, built.seed
        model, data, handles = built.model, built.data, built.handles
        self.description, self.limits, self.period_s = description, limits, STEPS * STEP_S
        self.world, self.truth = built.world, built.truth
        self.model, self.data, self.handles = model, data, handles
        s = handles.sensors
        self._s = s
        self._aperture = aperture = float(data.qpos[handles.jaw_qpos].sum())
        lag_s = conditions.following_error_s
        self._servo = Servo(model, data, handles, description, self.period_s, limits.stop_acceleration_m_s2, lag_s)
        built.proof.saw("following_error_s", 0.0, lag_s)
        self._servo.reset(np.array(data.qpos[handles.arm_qpos]))
        self._jaws = JawServo(built, aperture)
        self._wrist = WristSensor(description, conditions, seed, proof=built.proof)
        self._guard = HardLimitGuard(limits)
        self._tactile = Tactile(built)
        self._depth, self._taxels, self.proof = self._tactile.depth, self._tactile.taxels, built.proof
        self._poses = PoseReports(built)
        self._ctrl = np.zeros((STEPS, model.nu))
        self._arm_ctrl, self._jaw_ctrl = self._ctrl[:, handles.arm_ctrl], self._ctrl[:, handles.jaw_ctrl]
        self._samples = np.zeros((STEPS, model.nsensordata))
        held = handles.held_bodies.stop - handles.held_bodies.start
        self._external = np.zeros((STEPS, held, 6))  # torque, force
        # Views of one step each, made once, so that the loop around mj_step only copies (memoryviews copy 3x faster).
        self._rows = [
            (c.data, s.data, e.data)
            for c, s, e in zip(self._ctrl, self._samples, self._external.reshape(STEPS, -1), strict=True)
        ]
        self._ctrl_now, self._sensed = memoryview(data.ctrl), memoryview(data.sensordata)
        self._external_now = memoryview(data.cfrc_ext[handles.held_bodies].reshape(-1))
        self._hand = handles.hand_bodies.stop - handles.hand_bodies.start
        self._warnings, self._wrench_now = data.warning.number, data.sensordata[s.force.start : s.torque.stop]
        self._probe_now = data.xpos[handles.probe_body]
        first, *_, last = model.dof_jntid[handles.arm_dof].tolist()
        self._joints_now = data.xanchor[first : last + 1], data.xaxis[first : last + 1]
        self._pads_now = data.site_xpos[handles.pads_site], data.site_xmat[handles.pads_site].reshape(3, 3)
        self._ago_s = (np.arange(1, STEPS + 1, dtype=np.float64) - STEPS) * STEP_S
        self._cycles = 0
        self._tare: PendingTare | None = None
        self._payload: PendingPayload | None = None
        self._payload_load: tuple[float, Array] | None = None
        self._failed: BackendError | None = None
        self._closed = False
        self.true_force = TrueForce(limits)

        self.trace = ControlTrace(model, data) if traced else None
        self._keeper = SnapshotStore(model, data)
        self._filter = CollisionFilter(model, data, handles)

        self._samples[:] = data.sensordata
        self._wrist.fill(-self._samples[0, s.force.start : s.torque.stop])
        self._expected = self._wrist.expected(up_in(self._samples[0, s.quat]))
        first = GripperState(0.0, aperture, 0.0, False)
        self._reports = JawReports(conditions, seed, self.period_s, first, built.proof)
        self._observation = self._observe(Command())

    def observe(self) -> Observation:
        """See `Robot`."""
        return self._observation

    def cycle(self, command: Command) -> Observation:
        """See `Robot`."""
        if self._closed:
            raise BackendError("the robot is closed")
        if self._failed is not None:
            raise self._failed
        stopped = self._guard.tripped
        target = None
        if stopped is None:
            try:
                if command.gripper is not None:
                    self._jaws.check(command.gripper)
                if command.motion is not None:
                    target = self._servo.check(command.motion)
            except ParamError:
                self.hold()
                raise
            if command.gripper is not None:
                self._jaws.set(command.gripper)
        if self._payload_load is not None:
            self._servo.load(self._carry())
        self._servo.plan(target, self._arm_ctrl)
        self._jaws.plan(self._aperture, self.period_s, self._jaw_ctrl)
        try:
            with self._filter:
                self._advance()
            check_sane(self._warnings, self._samples, self.data.time)
        except mujoco.FatalError as e:
            self._failed = BackendError(f"MuJoCo failed at t={self.data.time:.3f} s: {e}")
            raise self._failed from e
        except BackendError as e:
            self._failed = e
            raise
        self._cycles += 1
        self._observation = self._observe(command)
        if self._guard.tripped is not None:
            raise self._guard.stop()
        return self._observation

    def start(self, request: Request) -> Ticket:
        """See `Robot`."""
        if isinstance(request, Tare):
            if self._tare is not None:
                self._tare.ticket.error, self._tare.ticket.done = "replaced by a newer tare", True
            self._tare = PendingTare(request, max(1, round(request.duration_s / self.period_s)))
            return self._tare.ticket
        if self._payload is not None:
            self._payload.ticket.error, self._payload.ticket.done = "replaced by a newer payload", True
        self._payload = PendingPayload(request, max(1, round(PAYLOAD_S / self.period_s)))
        return self._payload.ticket

    def hold(self) -> None:
        """See `Robot`.

        Time passes only in `cycle`, and a cycle without a motion brakes the arm to rest, so nothing is left to do.
        """

    def close(self) -> None:
        """See `Robot`."""
        self.hold()
        self._closed = True

    def snapshot(self) -> Snapshot:
        """See `Robot`."""
        if self._failed is not None:
            raise self._failed
        return self._keeper.take(self)

    def restore(self, snapshot: Snapshot) -> None:
        """See `Robot`. The control trace starts again."""
        self._keeper.put_back(self, snapshot)
        if self.trace is not None:
            self.trace = ControlTrace(self.model, self.data)

    def _advance(self) -> None:
        """Do the period's solver steps; check the wrench after each, and brake once its limit has tripped."""
        model, data, step, guard = self.model, self.data, mujoco.mj_step, self._guard
        ctrl_now, sensed, external_now = self._ctrl_now, self._sensed, self._external_now
        reading, expected = self._wrench_now, self._expected
        stands = guard.tripped is not None and float(np.abs(data.qvel[self.handles.arm_dof]).max()) < REST_RAD_S
        for i, (ctrl, sample, external) in enumerate(self._rows):
            if guard.tripped is not None and not stands:
                self._servo.brake(self._arm_ctrl[i])
            ctrl_now[:] = ctrl
            step(model, data)
            sample[:] = sensed
            external[:] = external_now
            if guard.tripped is None and not guard.is_quiet(reading, expected):
                # The sensor reads the force of the hand on the arm; the hand feels its opposite.
                guard.check(-reading - expected, self._twists_S, data.time)
        if guard.tripped is not None and not stands:
            self._servo.reset(np.array(data.qpos[self.handles.arm_qpos]))
        if self.trace is not None:
            self.trace.add(self._ctrl, model.actuator_forcerange)

    def _twists_S(self) -> Array:
        """Return the hand's twists (2, 6) at S in S, linear m/s then angular rad/s: measured, and of the setpoint."""
        h, jacobian = self.handles, np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, jacobian[:3], jacobian[3:], h.sensor_site)
        rates = np.stack([self.data.qvel[h.arm_dof], self._servo.rate])
        rotation = self.data.site_xmat[h.sensor_site].reshape(3, 3)
        return np.asarray((rates @ jacobian[:, h.arm_dof].T).reshape(2, 2, 3) @ rotation).reshape(2, 6)

    def _carry(self) -> Array:
        """Return the joint torques (dof,) that carry the believed payload."""
        mass, com_P = self._payload_load or (0.0, np.zeros(3))
        return carrying_torques(*self._joints_now, *self._pads_now, com_P, mass * GRAVITY_M_S2)

    def _observe(self, command: Command) -> Observation:
        """Return the observation of the samples just taken."""
        s, rows = self._s, self._samples.copy()
        now_s = self._cycles * self.period_s
        self._poses.correct(rows, s)
        quat = rows[:, s.quat]
        self._set_payload()
        up = up_in(quat[-1])
        wrench = self._wrist.measure(-rows[:, s.force.start : s.torque.stop], up)
        self._add_to_tare(wrench, up)
        self._expected = self._wrist.expected(up)
        pads = self._samples[-1, s.position]
        self.true_force.note(forces_2(self._external, self._probe_now, pads, self._hand))
        last = rows[-1].tolist()
        jaws, speeds, forces = last[s.jaws], last[s.jaw_speeds], last[s.jaw_forces]
        self._aperture = jaws[0] + jaws[1]
        self._tactile.sample(now_s, command.tactile, jaws, forces, command.images)
        gripper = self._reports.report(
            now_s,
            self._aperture - self._tactile.shift_m,
            speeds[0] + speeds[1],
            max(0.0, -0.5 * (forces[0] + forces[1])),
        )
        return Observation(
            stamp_s=now_s + self._ago_s,
            q=rows[:, s.q],
            dq=rows[:, s.dq],
            position_B_P=rows[:, s.position],
            quat_B_P=quat,
            wrench_S=wrench - self._wrist.bias,
            gripper=gripper,
            tactile=self._tactile.arrived(now_s, command.tactile),
            images=self._tactile.arrived_images(now_s),
        )

    def _set_payload(self) -> None:
        """Advance a payload request by one period; the block of its last period is compensated already."""
        if self._payload is None:
            return
        self._payload.periods -= 1
        if self._payload.periods <= 0:
            request = self._payload.request
            self._wrist.set_payload(request.mass_kg, request.com_P_m)
            self._payload_load = (request.mass_kg, request.com_P_m)
            self._payload.ticket.done = True
            self._payload = None

    def _add_to_tare(self, measured: Array, up_S: Array) -> None:
        """Add a block to a pending tare; the block of its last period is tared already."""
        if self._tare is not None and self._tare.add(measured):
            self._wrist.tare(self._tare.mean, up_S)
            self._tare.ticket.done = True
            self._tare = None
