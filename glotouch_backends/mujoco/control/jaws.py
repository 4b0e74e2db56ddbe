"""The gripper's controller: a speed-limited aperture ramp with limited force, and its delayed reports."""

from __future__ import annotations

import math
from collections import deque

import mujoco
import numpy as np

from glotouch_backends.mujoco.model import JAW_STIFFNESS_N_M, STEPS, Handles
from glotouch_bt.robot import Array, Conditions, Gripper, GripperState, GripperTarget, ParamError
from glotouch_bt.robot.scene import stream

MOVING_M_S = 0.002
"""Report the jaws as moving above this aperture rate. Source: ours."""
WINDUP_M = 0.001
"""Largest lead of the ramp over the jaws, beyond what the force limit needs. Source: ours."""


class JawServo:
    """Ramp both jaws' servo commands to the target; limit their force through the actuators' force range."""

    def __init__(self, model: mujoco.MjModel, handles: Handles, gripper: Gripper, aperture_m: float) -> None:
        self._gripper = gripper
        self._range = model.actuator_forcerange[handles.jaw_ctrl]
        self._target = GripperTarget(aperture_m, gripper.speed_m_s, gripper.force_N)
        self._lead = 0.0
        self._ramp = aperture_m
        self._steps = np.arange(1, STEPS + 1) / STEPS
        self._apply_force(gripper.force_N)

    def _apply_force(self, force_N: float) -> None:
        self._range[:, 0], self._range[:, 1] = -force_N, force_N
        self._lead = 2.0 * (force_N / JAW_STIFFNESS_N_M + WINDUP_M)

    def check(self, target: GripperTarget) -> None:
        """Refuse a target outside the gripper's range.

        Raises:
            ParamError: Not finite or outside the gripper's range.
        """
        g = self._gripper
        for name, value, low, high in (
            ("aperture_m", target.aperture_m, 0.0, g.stroke_m),
            ("speed_m_s", target.speed_m_s, 1e-4, g.speed_m_s),
            ("force_N", target.force_N, 0.1, g.force_N),
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
    """Delayed reports of the jaws with bias, noise and quantisation."""

    def __init__(self, conditions: Conditions, seed: int, period_s: float, first: GripperState) -> None:
        self._c = conditions
        self._rng = stream(seed, "aperture")
        self._bias = float(stream(seed, "aperture_bias").uniform(*conditions.aperture_bias_m))
        late = round(conditions.gripper_latency_s / period_s)
        first = self._spoil(first)
        self._line: deque[GripperState] = deque([first] * (late + 1), maxlen=late + 1)

    def _spoil(self, state: GripperState) -> GripperState:
        c = self._c
        aperture = state.aperture_m + self._bias
        if c.aperture_noise_sd_m > 0.0:
            aperture += c.aperture_noise_sd_m * float(self._rng.standard_normal())
        if c.aperture_resolution_m > 0.0:
            aperture = round(aperture / c.aperture_resolution_m) * c.aperture_resolution_m
        return GripperState(state.stamp_s, aperture, state.force_N, state.moving)

    def report(self, stamp_s: float, aperture_m: float, rate_m_s: float, force_N: float) -> GripperState:
        """Add the present true state; return the report that arrives now."""
        self._line.append(self._spoil(GripperState(stamp_s, aperture_m, force_N, abs(rate_m_s) > MOVING_M_S)))
        return self._line[0]
