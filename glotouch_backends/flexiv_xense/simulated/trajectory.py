"""The arm controller's motion generator: smooth joint motion from setpoints that arrive at any time.

Documented by the vendor: a new setpoint replaces the old one, and the motion is planned from the present commanded
    state
within the limits that came with it; after the target, its velocity is kept. The smoothing is not documented. ASSUMED:
one cubic to the target, in the streaming interval if the limits allow it, else in the shortest time that they allow.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from glotouch_backends.mujoco.control import hermite
from glotouch_backends.mujoco.model import STEP_S
from glotouch_bt.robot import Array

STREAM_S = 0.010
"""Shortest duration of a motion: the interval between two streamed setpoints."""
MAX_DURATION_S = 60.0
"""Longest duration of a motion."""
basis = lru_cache(maxsize=64)(hermite)


def cubic_extremes(delta: Array, v0: Array, v1: Array, time_s: float) -> tuple[Array, Array]:
    """Return the largest |velocity| and |acceleration| of a cubic over `delta` in `time_s` from v0 to v1, elementwise.

    The acceleration is linear in time, so its extremes are at the ends; the velocity's are there or where it is zero.
    """
    t = time_s
    a0, a1 = (6 * delta / t - 4 * v0 - 2 * v1) / t, (-6 * delta / t + 2 * v0 + 4 * v1) / t
    fastest = np.maximum(np.abs(v0), np.abs(v1))
    crosses = a0 * a1 < 0.0
    s = np.where(crosses, a0, 0.0) / np.where(crosses, a0 - a1, 1.0)
    middle = v0 + t * s * (a0 + 0.5 * s * (a1 - a0))
    return np.maximum(fastest, np.abs(middle)), np.maximum(np.abs(a0), np.abs(a1))


def shortest(fits: Callable[[float], bool]) -> float:
    """Return the shortest time, on a grid of 2 %, for which `fits` is True; at least the streaming interval."""
    time_s = STREAM_S
    while not fits(time_s) and time_s < MAX_DURATION_S:
        time_s *= 1.02
    return time_s


class Trajectory:
    """The commanded motion, one solver step at a time.

    Args:
        q: (dof,) start at rest.

    Attributes:
        q, dq, ddq: (dof,) present commanded state.
    """

    def __init__(self, q: Array) -> None:
        self.q, self.dq, self.ddq = q.copy(), np.zeros_like(q), np.zeros_like(q)
        self._rows: list[tuple[Array, Array, Array]] = []
        self._next = 0
        self._end = self.q, self.dq

    @property
    def goal_q(self) -> Array:
        """Joints (dof,) at the end of the motion."""
        return self._end[0]

    @property
    def at_rest(self) -> bool:
        """True if it is at rest and stays there."""
        return self._next >= len(self._rows) and not self._end[1].any()

    def go(self, q: Array, dq: Array, time_s: float) -> None:
        """Move to `q` (dof,), arriving with velocity `dq`, in `time_s` (rounded to whole solver steps)."""
        n = max(1, round(time_s / STEP_S))
        position, velocity = basis(n * STEP_S, n)
        knots = np.stack([self.q, self.dq, q, dq])
        # Ramp from the last motion's mean acceleration to this one's: a setpoint has no acceleration of its own.
        along = (np.arange(n) / n)[:, None]
        ddq = self.ddq + along * ((dq - self.dq) / (n * STEP_S) - self.ddq)
        self._rows = list(zip(position @ knots, velocity @ knots, ddq, strict=True))
        self._next, self._end = 0, (q, dq)

    def brake(self, deceleration_rad_s2: float) -> None:
        """Brake to rest uniformly; the fastest joint has this deceleration."""
        time_s = max(STREAM_S, float(np.abs(self.dq).max()) / deceleration_rad_s2)
        self.go(self.q + 0.5 * time_s * self.dq, np.zeros_like(self.q), time_s)

    def advance(self) -> tuple[Array, Array, Array]:
        """Return q, dq, ddq (dof,) at the start of the next step, and advance to its end."""
        i = self._next
        if i < len(self._rows):
            start = self._rows[i]
            self._next = i + 1
            self.q, self.dq, self.ddq = self._rows[i + 1] if i + 1 < len(self._rows) else (*self._end, start[2])
            return start
        q, dq = self.q, self.dq
        if dq.any():
            self.q = q + STEP_S * dq
        self.ddq = np.zeros_like(q)
        return q, dq, self.ddq
