"""Conversion of a device's stamps to this machine's clock.

The device's stamps give the intervals between readings. The offset between the clocks is the smallest one seen within a
window, because transport delays only add, and clocks drift.
"""

from __future__ import annotations

from collections import deque

WINDOW_S = 1.0
"""Window of the smallest offset. Source: ours; clocks that drift by 100 ppm differ by 0.1 ms after it."""
PART_S = 0.1
"""The window advances in parts of this length."""


class StampConverter:
    """Convert the stamps of one device; call it with every new reading, in order."""

    def __init__(self) -> None:
        self._first_ns: int | None = None
        self._parts: deque[float] = deque(maxlen=round(WINDOW_S / PART_S))
        self._until_s = -1.0
        self._last_s = float("-inf")

    def __call__(self, stamp: object, now_s: float) -> float:
        """Return the time on our clock, s: later than all before, at most a microsecond after `now_s`.

        Args:
            stamp: The device's (seconds, nanoseconds); for anything else the reading counts as measured now.
            now_s: Arrival time.
        """
        if not (isinstance(stamp, (tuple, list)) and len(stamp) == 2 and all(isinstance(v, int) for v in stamp)):
            return now_s
        whole_ns: int = stamp[0] * 1_000_000_000 + stamp[1]
        if self._first_ns is None:
            self._first_ns = whole_ns
        device_s = (whole_ns - self._first_ns) * 1e-9
        ahead_s = now_s - device_s
        if now_s >= self._until_s or not self._parts:
            self._parts.append(ahead_s)
            self._until_s = now_s + PART_S
        else:
            self._parts[-1] = min(self._parts[-1], ahead_s)
        made_s: float = device_s + min(self._parts)
        if made_s <= self._last_s:  # the window has just advanced
            made_s = self._last_s + 1e-6
        self._last_s = made_s
        return made_s
