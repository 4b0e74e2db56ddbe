"""Guard of a wrist that does not answer: a living force sensor feels the inertia of the hand in every motion.

Noise cannot tell this: a noise-free simulation has none, and a line that is dead from its first sample shows none to
learn. The first motion of a mission does, long before the hand meets anything.
"""

from __future__ import annotations

import math

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.robot.geometry import Array
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


@compiled(
    "f8[:, ::1]",
    "f8[:, ::1]",
    "f8[::1]",
    "i8",
    "given f8[:]",
    "given f8[:, :]",
    "given f8[:, :]",
    "given f8[:, :]",
    "f8[::1]",
)
def accelerating(
    track: Array,
    forces: Array,
    mean: Array,
    known: int,
    stamps: Array,
    position: Array,
    quat: Array,
    wrench: Array,
    com: Array,
) -> float:
    """Add a block to the motion of the last 2 `HALF` + 1 blocks; return its mean acceleration, m/s2.

    Negative if the hand slows down, zero if the motion is too short. The acceleration is a second difference at the
    true times. A force averaged with `WEIGHTS` belongs to it.

    Args:
        track, forces: (2 HALF + 1, 4) stamps and centres of the hand's mass in B, and (2 HALF, 3) mean forces, newest
            last.
        mean: (3,) filled with the weighted mean of the forces.
        known: Number of blocks before this one.
        stamps, position, quat, wrench: The samples of an `Observation`.
        com: (3,) centre of the hand's mass in P.
    """
    last, n = len(track) - 1, len(stamps)
    track[:last] = track[1:].copy()
    forces[: last - 1] = forces[1:].copy()
    w, i, j, k = quat[n - 1, 0], quat[n - 1, 1], quat[n - 1, 2], quat[n - 1, 3]
    x, y, z = com[0], com[1], com[2]
    a, b, c = 2 * (j * z - k * y), 2 * (k * x - i * z), 2 * (i * y - j * x)
    track[last, 0] = stamps[n - 1]
    track[last, 1] = position[n - 1, 0] + x + w * a + j * c - k * b
    track[last, 2] = position[n - 1, 1] + y + w * b + k * a - i * c
    track[last, 3] = position[n - 1, 2] + z + w * c + i * b - j * a
    for axis in range(3):
        total = 0.0
        for row in range(n):
            total += wrench[row, axis]
        forces[last - 1, axis] = total / n
        mean[axis] = 0.0
        for row in range(last):
            mean[axis] += WEIGHTS[row] * forces[row, axis]
    if known < last:
        return 0.0
    before_s, after_s = track[HALF, 0] - track[0, 0], track[last, 0] - track[HALF, 0]
    bend_2, gain_2 = 0.0, 0.0  # squared change of the velocity, change of the squared speed
    for axis in range(1, 4):
        after = (track[last, axis] - track[HALF, axis]) / after_s
        before = (track[HALF, axis] - track[0, axis]) / before_s
        bend_2 += (after - before) ** 2
        gain_2 += (after - before) * (after + before)
    acceleration: float = 2.0 * math.sqrt(bend_2) / (before_s + after_s)
    return acceleration if gain_2 >= 0.0 else -acceleration


class WristResponseGuard:
    """Compare the force on the wrist with the inertial force of the hand, once a period.

    Both are squared and summed while the hand gains speed, also over several motions. A hand that loses speed does not
    count: a contact that stops it cancels its inertia at the wrist. The direction of the force does not matter, because
    a sensor that shows something else is not silent.

    Args:
        robot: The guarded robot.
        guard_limits: Limits of the guards.
    """

    def __init__(self, robot: Robot, guard_limits: SupervisionLimits) -> None:
        gripper = robot.description.gripper
        self._mass_kg, com_E = gripper.mass_and_com_E()
        self._com_P = gripper.pose_E_P.inverse().apply(com_E)
        self._guard_limits, self._max_gap_s = guard_limits, MAX_GAP_PERIODS * robot.period_s
        self.reset()

    def reset(self) -> None:
        """Forget the motion so far."""
        self._track: Array = np.zeros((2 * HALF + 1, 4))
        self._forces: Array = np.zeros((2 * HALF, 3))
        self._force: Array = np.zeros(3)
        self._known = 0  # blocks in the track
        self._rest: Array | None = None  # mean force when the hand last did not accelerate
        self._due = self._felt = 0.0

    def check(self, o: Observation, findings: list[GuardFinding]) -> None:
        """Check one block."""
        stamp_s = float(o.stamp_s[-1])
        if self._known and stamp_s - self._track.item(-1, 0) > self._max_gap_s:
            self._known, self._rest = 0, None
        acceleration_m_s2 = accelerating(
            self._track, self._forces, self._force, self._known, o.stamp_s, o.position_B_P, o.quat_B_P, o.wrench_S,
            self._com_P,
        )  # fmt: skip
        self._known += 1
        if self._known <= 2 * HALF:
            return
        inertia_N = self._mass_kg * abs(acceleration_m_s2)
        if inertia_N < MIN_INERTIA_N or self._rest is None:
            self._rest = self._force.copy() if inertia_N < MIN_INERTIA_N else None
            return
        if acceleration_m_s2 < 0.0:
            return
        change = self._force - self._rest
        self._due += inertia_N**2
        self._felt += float(change @ change)
        if self._due >= self._guard_limits.proof_N2:
            if self._felt < self._guard_limits.silent_share * self._due:
                self._report(stamp_s, findings)
            self._due = self._felt = 0.0

    def _report(self, stamp_s: float, findings: list[GuardFinding]) -> None:
        share = (self._felt / self._due) ** 0.5
        limit = self._guard_limits.silent_share**0.5
        what = (
            f"the wrist shows {100.0 * share:.0f} % of the hand's inertia, at least {100.0 * limit:.0f} % are "
            "expected: the force sensor is dead, or its samples come late"
        )
        findings.append(GuardFinding("wrench_silent", what, share, limit, stamp_s))
