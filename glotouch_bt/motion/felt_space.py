"""Space in the container that the held tool has felt to be free.

The tool hangs straight down: its shaft stands above its ball. So where the ball passed without a contact, the column
above is free at every height, except for what reaches in between the radii of shaft and ball. Objects are pushed by
millimetres when they are touched, so columns near a touch are not trusted.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from glotouch_bt.robot import Array

FREE_M_S = 0.10
"""Speed at which the tool or the open fingers move through space that was felt to be free. Source: ours. It relies on
the record: something rigid that is met at half this speed gave 31 N in spite of the robot's own stop."""
STEP_M = 0.003
"""Spacing of the recorded places. Source: ours; half of the ball's radius."""
CLEAR_OF_TOUCH_M = 0.015
"""Distance from every touch within which columns are not trusted: an unobserved motion of an object is at most this
long. Source: `TraceParams.farthest_m`."""
HANDLED_M = 0.10
"""Distance from closing jaws within which an object may have been moved. Source: ours."""


class FeltSpace:
    """Record of where the held tool was, and where it was touched; in K."""

    def __init__(self) -> None:
        self._free_K_m: Array = np.zeros((0, 3))
        self._touched_K_m: Array = np.zeros((0, 2))

    def add(self, path_K_m: Array, touch_K_m: Array | None = None) -> None:
        """Record a path (n, 3) of the tool's reference point, and the point (2 or 3,) of a contact at its end."""
        path = np.asarray(path_K_m, dtype=np.float64).reshape(-1, 3)
        length = np.cumsum(np.linalg.norm(np.diff(path, axis=0, prepend=path[:1]), axis=1))
        new = np.diff(length // STEP_M, prepend=-1.0) > 0
        new[-1:] = True
        self._free_K_m = np.concatenate([self._free_K_m, path[new]])
        if touch_K_m is not None:
            self._touched_K_m = np.concatenate([self._touched_K_m, np.asarray(touch_K_m)[None, :2]])

    def add_hand(self, places_K_m: Array) -> None:
        """Record places (n, 2) where the open hand came down; they tell nothing of the wider ball."""
        above = np.column_stack([places_K_m, np.full(len(places_K_m), np.inf)])
        self._free_K_m = np.concatenate([self._free_K_m, above])

    def forget(self) -> None:
        """Remove everything: the objects may have been moved, or the tool was not held."""
        self._free_K_m, self._touched_K_m = np.zeros((0, 3)), np.zeros((0, 2))

    def forget_near(self, place_K_m: Array) -> None:
        """Remove what was felt within `HANDLED_M` of a place (2 or 3,): the jaws move what they close on."""
        far = np.linalg.norm(self._free_K_m[:, :2] - np.asarray(place_K_m)[:2], axis=1) > HANDLED_M
        self._free_K_m = self._free_K_m[far]

    def columns(self, height_K_m: float) -> Array:
        """Return the places (n, 2) with a free column down to a height of the tool's reference point."""
        low = self._free_K_m[self._free_K_m[:, 2] <= height_K_m][:, :2]
        far = np.ones(len(low), dtype=np.bool_)
        for touched in self._touched_K_m:
            far &= np.sum((low - touched) ** 2, axis=1) >= CLEAR_OF_TOUCH_M**2
        return low[far]

    def covers(self, places_K_m: Array, within_m: float) -> bool:
        """Return True if tool or hand stood free within a distance of each place (n, 2), near touches or not."""
        if not len(self._free_K_m):
            return False
        away = np.linalg.norm(self._free_K_m[None, :, :2] - places_K_m[:, None], axis=2).min(axis=1)
        return bool(away.max() <= within_m)

    def state(self) -> dict[str, Any]:
        """Return the record, for `restore`."""
        return {"free_K_m": self._free_K_m.copy(), "touched_K_m": self._touched_K_m.copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a `state`."""
        self._free_K_m = np.array(state["free_K_m"], dtype=np.float64).reshape(-1, 3)
        self._touched_K_m = np.array(state["touched_K_m"], dtype=np.float64).reshape(-1, 2)
