"""The clock of the page: which robot time is shown. Pure; thread-safe, because every browser calls it."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence

CATCH_UP_S = 0.25
"""Time constant with which a live view approaches the newest time: the record grows in steps of 0.5 s. Source: ours."""


class Player:
    """A position on the time line: following the newest entry, playing, or standing.

    Attributes:
        t_s: The robot clock that is shown.
        live: Follow the newest entry.
        playing: Move with `speed`; ends at the end of the record.
        speed: Robot seconds a second.
    """

    def __init__(self, *, live: bool) -> None:
        self._lock = threading.Lock()
        self.t_s = -math.inf  # the first step goes to the start, or to the newest entry
        self.live, self.playing, self.speed = live, False, 1.0

    @property
    def moving(self) -> bool:
        """It plays or follows."""
        return self.playing or self.live

    def advance(self, wall_s: float, span_s: tuple[float, float], *, growing: bool) -> float:
        """Move on by `wall_s` of wall time inside `span_s`; return the robot clock to show.

        Args:
            wall_s: Time since the last call.
            span_s: First and last entry.
            growing: The record is still being written.
        """
        start, end = span_s
        with self._lock:
            if self.live:
                near = end - self.t_s < 0.01 or self.t_s < start
                self.t_s = end if near else self.t_s + (end - self.t_s) * (1.0 - math.exp(-wall_s / CATCH_UP_S))
                if not growing and end - self.t_s < 0.01:
                    self.live, self.t_s = False, end
            elif self.playing:
                self.t_s += wall_s * self.speed
                if self.t_s >= end:
                    self.live, self.playing = growing, False
            self.t_s = min(max(self.t_s, start), end)
            return self.t_s

    def seek(self, t_s: float) -> None:
        """Stand at a time."""
        with self._lock:
            self.t_s, self.live, self.playing = t_s, False, False

    def jump(self, by_s: float) -> None:
        """Move by a time, and go on as before; a live view stands."""
        with self._lock:
            self.t_s, self.live = self.t_s + by_s, False

    def begin(self) -> None:
        """Go to the newest entry of another record, and follow it."""
        with self._lock:
            self.t_s, self.live, self.playing = -math.inf, True, False

    def follow(self) -> None:
        """Follow the newest entry."""
        with self._lock:
            self.live, self.playing = True, False

    def toggle(self, span_s: tuple[float, float]) -> None:
        """Play or stand; at the end, play from the start."""
        with self._lock:
            if self.playing or self.live:
                self.playing = self.live = False
                return
            if self.t_s >= span_s[1] - 0.01:
                self.t_s = span_s[0]
            self.playing = True

    def set_speed(self, speed: float) -> None:
        """Play with another speed."""
        with self._lock:
            self.speed = speed

    def to_mark(self, stamps_s: Sequence[float], *, forward: bool) -> bool:
        """Stand at the next stamp, or the one before; return False if there is none."""
        with self._lock:
            later = [s for s in stamps_s if s > self.t_s + 0.01]
            earlier = [s for s in stamps_s if s < self.t_s - 0.01]
            found = later[:1] if forward else earlier[-1:]
            if found:
                self.t_s, self.live, self.playing = found[0], False, False
            return bool(found)
