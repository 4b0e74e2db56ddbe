"""Guard of a wrist that does not answer: a living force sensor feels the inertia of the hand in every motion.

Noise cannot tell this: a noise-free simulation has none, and a line that is dead from its first sample shows none to
learn. The first motion of a mission does, long before the hand meets anything.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from glotouch_bt.robot.interface import Robot
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits

HALF = 3
"""Periods to each side of an acceleration: with 10 um of position noise, 60 ms give 0.03 m/s2. Source: ours."""
WEIGHTS = np.array([0.5, 1.5, 2.5, 2.5, 1.5, 0.5]) / 9.0
"""Share of each of the last 2 `HALF` blocks in the mean force: the triangle over which a second difference averages."""
MIN_INERTIA_N = 0.15
"""Count only a larger inertial force; uniform motion with irregular stamps stays below. Source: ours."""
MAX_GAP_PERIODS = 1.5
"""Start again after a longer gap between two blocks."""


class WristResponseGuard:
    """Compare the force on the wrist with the inertial force of the hand, once a period.

    Both are squared and summed while the hand accelerates, also over several motions. The direction does not matter: a
    sensor that shows something else is not silent, and contacts only add.

    Args:
        robot: The guarded robot.
        rules: Limits of the guards.
    """

    def __init__(self, robot: Robot, rules: SupervisionLimits) -> None:
        gripper = robot.description.gripper
        self._mass_kg, com_E = gripper.mass_and_com_E()
        self._com_P = gripper.pose_E_P.inverse().apply(com_E).tolist()
        self._rules, self._max_gap_s = rules, MAX_GAP_PERIODS * robot.period_s
        self.reset()

    def reset(self) -> None:
        """Forget the motion so far."""
        self._track: deque[tuple[float, float, float, float]] = deque(maxlen=2 * HALF + 1)
        self._forces: deque[list[float]] = deque(maxlen=2 * HALF)
        self._rest: list[float] | None = None  # mean force when the hand last did not accelerate
        self._due = self._felt = 0.0

    def check(self, o: Observation, findings: list[GuardFinding]) -> None:
        """Check one block."""
        stamp_s = float(o.stamp_s[-1])
        if self._track and stamp_s - self._track[-1][0] > self._max_gap_s:
            self._track.clear()
            self._rest = None
        self._track.append((stamp_s, *self._centre_B_m(o)))
        self._forces.append((o.wrench_S[:, :3].sum(axis=0) / len(o.stamp_s)).tolist())
        if len(self._track) <= 2 * HALF:
            return
        inertia_N = self._mass_kg * self._acceleration_m_s2()
        force = (WEIGHTS @ np.array(self._forces)).tolist()
        if inertia_N < MIN_INERTIA_N or self._rest is None:
            self._rest = force if inertia_N < MIN_INERTIA_N else None
            return
        self._due += inertia_N**2
        self._felt += sum((f - r) ** 2 for f, r in zip(force, self._rest, strict=True))
        if self._due >= self._rules.proof_N2:
            if self._felt < self._rules.silent_share * self._due:
                self._report(stamp_s, findings)
            self._due = self._felt = 0.0

    def _centre_B_m(self, o: Observation) -> tuple[float, float, float]:
        """Return the centre of the hand's mass in B."""
        w, i, j, k = o.quat_B_P[-1].tolist()
        x, y, z = self._com_P
        a, b, c = 2 * (j * z - k * y), 2 * (k * x - i * z), 2 * (i * y - j * x)
        px, py, pz = o.position_B_P[-1].tolist()
        return px + x + w * a + j * c - k * b, py + y + w * b + k * a - i * c, pz + z + w * c + i * b - j * a

    def _acceleration_m_s2(self) -> float:
        """Return the mean acceleration over the last 2 `HALF` periods, a second difference at their true times."""
        (t0, *first), (t1, *middle), (t2, *last) = self._track[0], self._track[HALF], self._track[-1]
        bends = [(c - b) / (t2 - t1) - (b - a) / (t1 - t0) for a, b, c in zip(first, middle, last, strict=True)]
        return float(2.0 * sum(v * v for v in bends) ** 0.5 / (t2 - t0))

    def _report(self, stamp_s: float, findings: list[GuardFinding]) -> None:
        share = (self._felt / self._due) ** 0.5
        limit = self._rules.silent_share**0.5
        what = (
            f"the wrist shows {100.0 * share:.0f} % of the hand's inertia, at least {100.0 * limit:.0f} % are "
            "expected: the force sensor is dead, or its samples come late"
        )
        findings.append(GuardFinding("wrench_silent", what, share, limit, stamp_s))
