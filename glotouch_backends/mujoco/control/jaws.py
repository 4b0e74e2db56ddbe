"""The gripper's controller: a speed-limited aperture ramp with limited force, and its delayed reports."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.model import JAW_STIFFNESS_N_M, STEPS, BuiltWorld
from glotouch_bt.robot import Array, Conditions, GripperState, GripperTarget, ParamError
from glotouch_bt.robot.scene import stream

MOVING_M_S = 0.002
"""Report the jaws as moving above this aperture rate. Source: ours."""
MIN_FORCE_N = 0.1
"""Smallest closing force. Source: ours."""
NOISE_REPORTS = 128
"""Number of reports for which noise is drawn at once."""
WINDUP_M = 0.001
"""Largest lead of the ramp over the jaws, beyond what the force limit needs. Source: ours."""


def force_errors(conditions: Conditions, seed: int) -> tuple[float, float]:
    """Draw gain and offset (N) of the true closing force over the one that the gripper is asked for and reports."""
    rng = stream(seed, "jaw force")
    return float(rng.uniform(*conditions.jaw_force_gain)), float(rng.uniform(*conditions.jaw_force_offset_N))


class JawServo:
    """Ramp both jaws' servo commands to the target; limit their force through the actuators' force range.

    Args:
        built: The world.
        aperture_m: Present aperture.
    """

    def __init__(self, built: BuiltWorld, aperture_m: float) -> None:
        model, handles, gripper = built.model, built.handles, built.description.gripper
        self._gripper, self._proof = gripper, built.proof
        self._force_gain, self._force_offset_N = force_errors(built.conditions, built.seed)
        self._range = model.actuator_forcerange[handles.jaw_ctrl]
        self._target = GripperTarget(aperture_m, gripper.speed_m_s, gripper.force_N)
        self._lead = 0.0
        self._ramp = aperture_m
        self._steps = np.arange(1, STEPS + 1) / STEPS
        self._apply_force(gripper.force_N)

    def _apply_force(self, force_N: float) -> None:
        gained = force_N * self._force_gain
        true_N = max(gained + self._force_offset_N, MIN_FORCE_N)
        self._proof.saw("jaw_force_gain", force_N, gained)
        self._proof.saw("jaw_force_offset_N", gained, gained + self._force_offset_N)
        self._range[:, 0], self._range[:, 1] = -true_N, true_N
        self._lead = 2.0 * (true_N / JAW_STIFFNESS_N_M + WINDUP_M)

    def check(self, target: GripperTarget) -> None:
        """Refuse a target outside the gripper's range.

        Raises:
            ParamError: Not finite or outside the gripper's range.
        """
        g = self._gripper
        for name, value, low, high in (
            ("aperture_m", target.aperture_m, 0.0, g.stroke_m),
            ("speed_m_s", target.speed_m_s, 1e-4, g.speed_m_s),
            ("force_N", target.force_N, MIN_FORCE_N, g.force_N),
        ):
            if not (math.isfinite(value) and low - 1e-9 <= value <= high + 1e-9):
                raise ParamError(f"gripper.{name}", value, f"within {low:g} .. {high:g}")

    def set(self, target: GripperTarget) -> None:
        """Set a new (checked) target."""
        if target.force_N != self._target.force_N:
            self._apply_force(target.force_N)
        self._target = target

    def plan(self, aperture_m: float, period_s: float, ctrl: Array) -> None:
        """Fill ctrl (steps, 2), the travel of each jaw, for the next period; `aperture_m` is the present one."""
        start = min(max(self._ramp, aperture_m - self._lead), aperture_m + self._lead)
        step = self._target.speed_m_s * period_s
        end = start + min(max(self._target.aperture_m - start, -step), step)
        self._ramp = end
        if start == end:
            ctrl[:] = 0.5 * end
        else:
            ctrl[:] = (0.5 * (start + (end - start) * self._steps))[:, None]


class JawReports:
    """Delayed reports of the jaws with flexing fingers, backlash, bias, noise and quantisation.

    The aperture is measured at the motor. Under a closing force F each fingertip stays behind by flex x F; and the
    pads follow the motor with a play of width b, so that the motor is within b / 2 of them.

    Args:
        conditions, seed: The disturbances and the source of their draws.
        period_s: Control period.
        first: First true state.
        proof: Notes which axes altered a report; default: one of its own.
    """

    def __init__(
        self,
        conditions: Conditions,
        seed: int,
        period_s: float,
        first: GripperState,
        proof: AxisProof | None = None,
    ) -> None:
        self._c, self._proof = conditions, proof or AxisProof(conditions)
        self._rng = stream(seed, "aperture")
        self._noise: list[float] = []  # drawn and not used yet, last first
        self._force_gain, self._force_offset_N = force_errors(conditions, seed)
        self._motor_m = first.aperture_m + 0.5 * conditions.jaw_backlash_m
        self._bias = float(stream(seed, "aperture_bias").uniform(*conditions.aperture_bias_m))
        late = round(conditions.gripper_latency_s / period_s)
        first = self._spoil(first)
        self._line: deque[GripperState] = deque([first] * (late + 1), maxlen=late + 1)

    def _spoil(self, state: GripperState) -> GripperState:
        c = self._c
        force, aperture = state.force_N, state.aperture_m
        if c.finger_flex_m_per_N > 0.0 and force > 0.0:
            aperture -= 2.0 * c.finger_flex_m_per_N * force
            self._proof.saw("finger_flex_m_per_N", state.aperture_m, aperture)
        if c.jaw_backlash_m > 0.0:
            play = 0.5 * c.jaw_backlash_m
            self._motor_m = min(max(self._motor_m, aperture - play), aperture + play)
            self._proof.saw("jaw_backlash_m", aperture, self._motor_m)
            aperture = self._motor_m
        offset_N = min(max(self._force_offset_N, -force), force)  # no force is reported as none
        force = (force - offset_N) / self._force_gain
        aperture += self._bias
        if c.aperture_noise_sd_m > 0.0:
            if not self._noise:
                self._noise = self._rng.standard_normal(NOISE_REPORTS)[::-1].tolist()
            aperture += c.aperture_noise_sd_m * self._noise.pop()
        if c.aperture_resolution_m > 0.0:
            aperture = round(aperture / c.aperture_resolution_m) * c.aperture_resolution_m
        return GripperState(state.stamp_s, aperture, force, state.moving)

    def report(self, stamp_s: float, aperture_m: float, rate_m_s: float, force_N: float) -> GripperState:
        """Add the present true state; return the report that arrives now."""
        self._line.append(self._spoil(GripperState(stamp_s, aperture_m, force_N, abs(rate_m_s) > MOVING_M_S)))
        return self._line[0]
