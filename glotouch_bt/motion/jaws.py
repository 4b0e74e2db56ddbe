"""When do the jaws stand still? Decided from late, noisy reports."""

from __future__ import annotations

from collections import deque

import numpy as np

from glotouch_bt.robot import GripperState

# Reports older than this after the command cannot show the motion yet (latency up to 30 ms, plus the start itself).
REACTION_S = 0.06
STILL_S = 0.06
# Drift between the halves of the still window that still counts as rest: 5 mm/s, ten times the reported noise's mean.
DRIFT_M = 3e-4


class JawWatch:
    """Judges rest from successive gripper reports.

    Args:
        period_s: Control period.
    """

    def __init__(self, period_s: float) -> None:
        self._window: deque[GripperState] = deque(maxlen=max(4, round(STILL_S / period_s)))
        self._begin_s: float | None = None
        self._last: GripperState | None = None

    def still(self, now_s: float, report: GripperState) -> bool:
        """Take one report; True once the jaws have been at rest for the whole window."""
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
        return bool(abs(apertures[:half].mean() - apertures[half:].mean()) < DRIFT_M)

    def state(self) -> GripperState:
        """The newest report, its aperture and force averaged over the still window.

        Raises:
            ValueError: No report was taken.
        """
        if self._last is None:
            raise ValueError("no gripper report was taken")
        if not self._window:
            return self._last
        return GripperState(
            self._last.stamp_s,
            float(np.mean([r.aperture_m for r in self._window])),
            float(np.mean([r.force_N for r in self._window])),
            self._last.moving,
        )
