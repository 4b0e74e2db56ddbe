"""The simulated gripper's controller and the processing of its two pads."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from glotouch_backends.mujoco.control import JawReports, JawServo
from glotouch_backends.mujoco.model import STEP_S, STEPS, BuiltWorld
from glotouch_backends.mujoco.sensing import Tactile
from glotouch_bt.robot import Array, GelImages, GripperState, GripperTarget, TactileFrame

PERIOD_S = STEPS * STEP_S
WANTED_S = 0.1
"""The gel model runs while a sensor has been read within this time."""


class JawStatus(NamedTuple):
    """Status of the gripper: m, m/s, N."""

    aperture_m: float
    speed_m_s: float
    force_N: float


class SimulatedHand:
    """Jaws and pads. The world steps them once a period.

    Args:
        built: The world.

    Attributes:
        status: Last report of the jaws.
        frame: Last pair of depth maps that arrived, or None.
        images: Last pair of gel images that arrived, or None.
    """

    def __init__(self, built: BuiltWorld) -> None:
        handles, conditions = built.handles, built.conditions
        self._s = handles.sensors
        self.gripper = built.description.gripper
        self._aperture = aperture = float(built.data.qpos[handles.jaw_qpos].sum())
        self._jaws = JawServo(built, aperture)
        self._rows = np.zeros((STEPS, 2))
        self._tactile = Tactile(built)
        first = GripperState(0.0, aperture, 0.0, False)
        self._reports = JawReports(conditions, built.seed, PERIOD_S, first, built.proof)
        late = round(conditions.gripper_latency_s / PERIOD_S)
        self._speeds: deque[float] = deque([0.0] * (late + 1), maxlen=late + 1)
        self._now_s = 0.0
        self._wanted_s = -math.inf
        self.status = JawStatus(aperture, 0.0, 0.0)
        self.frame: TactileFrame | None = None
        self.images: GelImages | None = None
        self._images_wanted = False

    def go_to(self, position_m: float, speed_m_s: float, force_N: float) -> None:
        """Set a target from the next period on; clamp it to the ranges, and ignore what is not finite."""
        g = self.gripper
        if not all(map(math.isfinite, (position_m, speed_m_s, force_N))):
            return
        target = GripperTarget(
            min(max(position_m, 0.0), g.stroke_m),
            min(max(abs(speed_m_s), 1e-4), g.speed_m_s),
            min(max(abs(force_N), 0.1), g.force_N),
        )
        self._jaws.set(target)

    def want_frames(self) -> None:
        """Note that a sensor is being read."""
        self._wanted_s = self._now_s

    def want_images(self) -> None:
        """Note that a sensor is asked for its image; it is rendered with the next frame, as it costs much time."""
        self._images_wanted = True

    def begin(self) -> Array:
        """Return the jaws' servo commands (steps, 2) of the next period."""
        self._jaws.plan(self._aperture, PERIOD_S, self._rows)
        return self._rows

    def end(self, now_s: float, row: Array) -> None:
        """Process the last sensor row of a period."""
        s = self._s
        self._now_s = now_s
        last = row.tolist()
        jaws, speeds, forces = last[s.jaws], last[s.jaw_speeds], last[s.jaw_forces]
        self._aperture = jaws[0] + jaws[1]
        wanted = now_s - self._wanted_s <= WANTED_S
        self._tactile.sample(now_s, wanted, jaws, forces, self._images_wanted)
        self._images_wanted = False
        rate = speeds[0] + speeds[1]
        force = max(0.0, -0.5 * (forces[0] + forces[1]))
        report = self._reports.report(now_s, self._aperture - self._tactile.shift_m, rate, force)
        self._speeds.append(rate)
        self.status = JawStatus(report.aperture_m, self._speeds[0], report.force_N)
        self.frame = self._tactile.arrived(now_s, True) or self.frame
        self.images = self._tactile.arrived_images(now_s) or self.images
