"""Detection of jaw rest from delayed, noisy gripper reports."""

from __future__ import annotations

from collections import deque

import numpy as np

from glotouch_bt.robot import GripperState

REACTION_S = 0.06
"""Reports earlier than this after the command do not show the motion yet: latency up to 30 ms plus the start."""
STILL_S = 0.06
"""Length of the rest window."""
MAX_DRIFT_M = 3e-4
"""Maximum difference between the mean apertures of the window's halves at rest: 5 mm/s, ten times the noise."""


class JawRestDetector:
    """Detect jaw rest from successive gripper reports.

    Args:
        period_s: Control period.
    """

    def __init__(self, period_s: float) -> None:
        self._window: deque[GripperState] = deque(maxlen=max(4, round(STILL_S / period_s)))
        self._begin_s: float | None = None
        self._last: GripperState | None = None

    def still(self, now_s: float, report: GripperState) -> bool:
        """Add one report; return True once the jaws have been at rest for the whole window."""
        if self._begin_s is None:
            self._begin_s = now_s
        self._last = report
        if report.moving or now_s - self._begin_s < REACTION_S:
            self._window.clear()
            return False
        self._window.append(report)
        if len(self._window) < (self._window.maxlen or 0):
            return False
        apertures = np.array([r.aperture_m for r in self._window])
        half = len(apertures) // 2
        return bool(abs(apertures[:half].mean() - apertures[half:].mean()) < MAX_DRIFT_M)

    def state(self) -> GripperState:
        """Return the newest report with aperture and force averaged over the rest window.

        Raises:
            ValueError: No report was added yet.
        """
        if self._last is None:
            raise ValueError("no gripper report was added yet")
        if not self._window:
            return self._last
        return GripperState(
            self._last.stamp_s,
            float(np.mean([r.aperture_m for r in self._window])),
            float(np.mean([r.force_N for r in self._window])),
            self._last.moving,
        )
