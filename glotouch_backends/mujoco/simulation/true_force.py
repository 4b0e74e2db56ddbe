"""The true contact force on the hand: its peak, and how long it passed the hard limit. For scoring only."""

from __future__ import annotations

from glotouch_bt.robot import Array, Limits


class TrueForce:
    """Peak of the true contact force on the hand and the held probe, and the longest time beyond the hard limit.

    Attributes:
        peak_N: Largest norm so far.
        samples_over: Largest number so far of consecutive samples beyond the hard limit.
    """

    def __init__(self, limits: Limits | None = None) -> None:
        self._limit_2 = (limits or Limits()).hard_force_N ** 2
        self.peak_N, self.samples_over, self._over_now = 0.0, 0, 0

    def note(self, squares: Array) -> None:
        """Take the squares (n,) of the force in the samples of one period, N^2."""
        largest = max(squares.tolist())
        self.peak_N = max(self.peak_N, largest**0.5)
        if largest <= self._limit_2:
            self._over_now = 0
            return
        for over in squares > self._limit_2:
            self._over_now = self._over_now + 1 if over else 0
            self.samples_over = max(self.samples_over, self._over_now)
