"""When a reading was made, on this machine's clock, told from the device's own stamp of it.

A reading is asked for a little after it was made, now less, now more. The device's stamps tell how far apart readings
are; how far its clock is from ours is told by the reading that came quickest of late: clocks drift, delays only add.
"""

from __future__ import annotations

from collections import deque

WINDOW_S = 1.0
"""The quickest reading of so long counts: clocks that drift by 100 ppm are 0.1 ms apart by then."""
PART_S = 0.1
"""The window moves on in parts of this length."""


class StampConverter:
    """Dates one device's readings; call it with every new one, in order."""

    def __init__(self) -> None:
        self._first_ns: int | None = None
        self._parts: deque[float] = deque(maxlen=round(WINDOW_S / PART_S))
        self._until_s = -1.0
        self._last_s = float("-inf")

    def __call__(self, stamp: object, now_s: float) -> float:
        """Seconds on our clock, later than all before; at most a microsecond later than `now_s`.

        Args:
            stamp: The device's (seconds, nanoseconds); anything else: it is taken to have been made now.
            now_s: When it arrived.
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
        if made_s <= self._last_s:  # the window has just moved on
            made_s = self._last_s + 1e-6
        self._last_s = made_s
        return made_s
