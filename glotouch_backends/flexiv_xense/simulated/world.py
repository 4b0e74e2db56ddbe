"""The world of the simulated devices: the MuJoCo backend's, stepped one millisecond at a time."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from glotouch_backends.flexiv_xense.simulated.arm import SimulatedArm
from glotouch_backends.flexiv_xense.simulated.hand import SimulatedHand
from glotouch_backends.mujoco import MAX_HELD_DISTANCE_M, build_world
from glotouch_backends.mujoco.control import check_sane
from glotouch_backends.mujoco.model import STEP_S, STEPS
from glotouch_backends.mujoco.simulation import ControlTrace, TrueForce
from glotouch_backends.options import WorldOptions
from glotouch_backends.rizon4 import RIZON4_XENSE
from glotouch_backends.trial_message import trial_of_message
from glotouch_bt.robot import BackendError, BadInput, Conditions, World


class SimulatedWorld:
    """World of one trial with the firmware of its devices; it does not know the vendors' API.

    The same seed gives the same world as the MuJoCo backend and sensors with the same noise.

    Args:
        world, conditions, seed: As for a backend.
        options: Options of the world.
    """

    def __init__(self, world: World, conditions: Conditions, seed: int, options: WorldOptions) -> None:
        self.world, self.description = world, RIZON4_XENSE
        exact = [axis for axis in ("kinematic_error_sd_m", "following_error_s") if getattr(conditions, axis)]
        if exact:
            changes = "".join(f"+{axis}=0" for axis in exact)
            raise BadInput(f"the simulated arm has no {', '.join(exact)}; use --conditions {conditions.name}{changes}")
        built = build_world(self.description, world, conditions, seed, options)
        self.truth, self.model, self.data, self.handles = built.truth, built.model, built.data, built.handles
        self.trace: ControlTrace | None = None
        self.true_force = TrueForce()
        self.proof = built.proof
        self.arm = SimulatedArm(built)
        self.hand = SimulatedHand(built)
        self.steps = 0
        h = self.handles
        self._ctrl = np.array(self.data.ctrl)
        self._arm_ctrl, self._jaw_ctrl = self._ctrl[h.arm_ctrl], self._ctrl[h.jaw_ctrl]
        self._jaw_rows = np.zeros((STEPS, 2))
        held = h.held_bodies.stop - h.held_bodies.start
        self._external = np.zeros((STEPS, held, 6))  # torque, force
        self._external_now = self.data.cfrc_ext[h.held_bodies]
        self._samples = np.zeros((STEPS, self.model.nsensordata))
        self._counted = np.ones(held)  # the probe's bodies, from 3 on, count while it is held

    @classmethod
    def of_message(cls, message: bytes) -> SimulatedWorld:
        """Build the world of a trial message; errors as in `trial_of_message` and `build_world`."""
        with trial_of_message(message) as trial:
            return cls(*trial)

    @property
    def now_s(self) -> float:
        """World time."""
        return self.steps * STEP_S

    def advance(self, stamp_s: float) -> None:
        """Step the world to `stamp_s`.

        Raises:
            BackendError: MuJoCo failed; cause chained.
        """
        try:
            for _ in range(round(stamp_s / STEP_S) - self.steps):
                self._step()
        except mujoco.FatalError as e:
            raise BackendError(f"MuJoCo failed at t={self.now_s:.3f} s: {e}") from e

    def _step(self) -> None:
        """Step one millisecond, and do at its end what the MuJoCo backend does once a control period."""
        i = self.steps % STEPS
        if i == 0:
            self.arm.carry()
            self._jaw_rows = self.hand.begin()
        self.arm.control(self._arm_ctrl)
        self._jaw_ctrl[:] = self._jaw_rows[i]
        self.data.ctrl[:] = self._ctrl
        mujoco.mj_step(self.model, self.data)
        self.steps += 1
        row = self.data.sensordata.copy()
        self._samples[i] = row
        self._external[i] = self._external_now
        self.arm.sense(self.steps, row)
        if i == STEPS - 1:
            check_sane(self.data.warning.number, self._samples, self.data.time)
            self._note_peak()
            self.hand.end(self.now_s, self._samples[-1])

    def contact_force_N(self) -> float:
        """Return the true contact force of the last step on the hand, and on the probe while it is held."""
        force = (self._counted @ np.asarray(self._external_now))[3:]
        return math.sqrt(float(force @ force))

    def _note_peak(self) -> None:
        """Note the true contact force on the hand, and on the probe while it is held."""
        h = self.handles
        gap = self.data.xpos[h.probe_body] - self._samples[-1, h.sensors.position]
        self._counted[3:] = float(gap @ gap) < MAX_HELD_DISTANCE_M**2
        force = (self._counted @ self._external)[:, 3:]
        self.true_force.note((force * force).sum(axis=1))
