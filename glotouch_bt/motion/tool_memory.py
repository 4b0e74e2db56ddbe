"""Memory of what was felt: free space, places where a fingertip came down on something, and the tool's displacement.

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
SAME_PLACE_M = 0.004
"""Two places of fingertips are the same within this distance. Source: ours; a fingertip's places are at most 7 mm
apart."""
COVERED_SHARE = 0.5
"""A fingertip meets the same again if it covers this share of the places of one that met something. Source: ours."""
MAX_DISPLACEMENT_M = 0.0015
"""Largest displacement to correct. Source: ours; the overlap of the simulated holder's rails with the handle. Beyond
it, the handle has left its rails and is tilted."""


class FeltSpace:
    """Record of where the held tool and the open fingers were, and where they were touched; in K."""

    def __init__(self) -> None:
        self._free_K_m: Array
        self._hand_K_m: Array
        self._touched_K_m: Array
        self._met_K_m: list[Array]
        self._moved: Array
        self.forget()

    def add(self, path_K_m: Array, touch_K_m: Array | None = None) -> None:
        """Record a path (n, 3) of the tool's reference point, and the point (2 or 3,) of a contact at its end."""
        path = np.asarray(path_K_m, dtype=np.float64).reshape(-1, 3)
        length = np.cumsum(np.linalg.norm(np.diff(path, axis=0, prepend=path[:1]), axis=1))
        new = np.diff(length // STEP_M, prepend=-1.0) > 0
        new[-1:] = True
        self._free_K_m = np.concatenate([self._free_K_m, path[new]])
        if touch_K_m is not None:
            self._touched_K_m = np.concatenate([self._touched_K_m, np.asarray(touch_K_m)[None, :2]])

    def add_hand(self, places_K_m: Array, tips_K_m: float) -> None:
        """Record places (n, 2) where the open fingers stood, at a height; they tell nothing of the wider ball."""
        stood = np.column_stack([places_K_m, np.full(len(places_K_m), tips_K_m)])
        self._hand_K_m = np.concatenate([self._hand_K_m, stood])

    def add_met(self, places_K_m: Array, tip_K_m: float) -> None:
        """Record the places (n, 2) under a fingertip that came down on something, and the tip's height."""
        self._met_K_m.append(np.column_stack([places_K_m, np.full(len(places_K_m), tip_K_m)]))

    def forget(self) -> None:
        """Remove everything: the objects may have been moved, or the tool was not held."""
        self._free_K_m, self._hand_K_m, self._touched_K_m = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2))
        self._met_K_m, self._moved = [], np.zeros((0, 3))

    def forget_free_near(self, place_K_m: Array) -> None:
        """Remove the free space that was felt within `HANDLED_M` of a place (2 or 3,): something stands in it."""
        self._free_K_m, self._hand_K_m = (
            felt[_away_m(felt, place_K_m) > HANDLED_M] for felt in (self._free_K_m, self._hand_K_m)
        )

    def forget_near(self, place_K_m: Array) -> None:
        """Remove what was felt within `HANDLED_M` of a place (2 or 3,): the jaws move what they close on."""
        self.forget_free_near(place_K_m)
        self._met_K_m = [met for met in self._met_K_m if _away_m(met, place_K_m).min() > HANDLED_M]
        self._moved = self._moved[_away_m(self._moved, place_K_m) > HANDLED_M]

    def moved_a_little(self, place_K_m: Array, share: float) -> None:
        """Record a small motion of what stands at a place (2,), and forget what was felt near it once they add up to 1.

        The share is 1 for a motion after which nothing that was felt near the object holds.
        """
        self._moved = np.concatenate([self._moved, [[*np.asarray(place_K_m)[:2], share]]])
        if self._moved[_away_m(self._moved, place_K_m) <= HANDLED_M, 2].sum() >= 1.0:
            self.forget_near(place_K_m)

    def met_below(self, places_K_m: Array, tip_K_m: float) -> float | None:
        """Return the height in K at which a fingertip that goes down to `tip_K_m` will meet what one met before.

        None if it is not expected to: it covers less than `COVERED_SHARE` of where each earlier one came down.

        Args:
            places_K_m: (n, 2) places under the fingertip.
            tip_K_m: Height to which it goes.
        """
        heights = [
            float(met[0, 2])
            for met in self._met_K_m
            if met[0, 2] > tip_K_m and np.mean(_nearest_m(met, places_K_m) <= SAME_PLACE_M) >= COVERED_SHARE
        ]
        return max(heights, default=None)

    def columns(self, height_K_m: float) -> Array:
        """Return the places (n, 2) with a free column down to a height of the tool's reference point."""
        low = self._free_K_m[self._free_K_m[:, 2] <= height_K_m][:, :2]
        far = np.ones(len(low), dtype=np.bool_)
        for touched in self._touched_K_m:
            far &= np.sum((low - touched) ** 2, axis=1) >= CLEAR_OF_TOUCH_M**2
        return low[far]

    def free_down_to(self, places_K_m: Array, within_m: float) -> float:
        """Return the height in K down to which the fingers find free space at all places (n, 2).

        The tool, or the open fingers themselves, stood within a distance of each of them, near touches or not; a tool
        counts as on the floor. Infinite if nothing stood near one.
        """
        free = np.concatenate([self._free_K_m * [1.0, 1.0, 0.0], self._hand_K_m])
        away = np.linalg.norm(free[None, :, :2] - places_K_m[:, None], axis=2)
        return float(np.where(away <= within_m, free[:, 2], np.inf).min(axis=1, initial=np.inf).max())

    def state(self) -> dict[str, Any]:
        """Return the record, for `restore`."""
        return {
            "free_K_m": self._free_K_m.copy(),
            "hand_K_m": self._hand_K_m.copy(),
            "touched_K_m": self._touched_K_m.copy(),
            "met_K_m": [met.copy() for met in self._met_K_m],
            "moved": self._moved.copy(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a `state`."""
        self._free_K_m = np.array(state["free_K_m"], dtype=np.float64).reshape(-1, 3)
        self._hand_K_m = np.array(state["hand_K_m"], dtype=np.float64).reshape(-1, 3)
        self._touched_K_m = np.array(state["touched_K_m"], dtype=np.float64).reshape(-1, 2)
        self._met_K_m = [np.array(met, dtype=np.float64).reshape(-1, 3) for met in state["met_K_m"]]
        self._moved = np.array(state["moved"], dtype=np.float64).reshape(-1, 3)


def _away_m(places_K_m: Array, place_K_m: Array) -> Array:
    """Return the horizontal distances (n,) of places (n, 2 or 3) from one place (2 or 3,)."""
    return np.asarray(np.linalg.norm(places_K_m[:, :2] - np.asarray(place_K_m)[:2], axis=1))


def _nearest_m(places_K_m: Array, others_K_m: Array) -> Array:
    """Return the horizontal distances (n,) of places (n, 2 or 3) from the nearest of others (m, 2 or 3)."""
    return np.asarray(np.linalg.norm(places_K_m[:, None, :2] - others_K_m[None, :, :2], axis=2).min(axis=1))


class ToolSeat:
    """Record of the tool's tip in the hand.

    A tool slides a little in the jaws with every use. Put back at the hand's nominal place, it stands beside its own,
    and after some rounds it is no longer on its rails. The first measurement shows how the tool is made, later ones how
    it was displaced.
    """

    def __init__(self) -> None:
        self._first_B_m: Array | None = None
        self._now_B_m: Array | None = None

    def measured(self, tip_B_m: Array) -> None:
        """Record the horizontal offset (2,) in B of the tool's tip from P, with the hand as it took the tool."""
        self._now_B_m = np.array(tip_B_m, dtype=np.float64)
        if self._first_B_m is None:
            self._first_B_m = self._now_B_m

    def released(self) -> None:
        """Forget the last measurement: the tool is no longer in the hand."""
        self._now_B_m = None

    @property
    def displacement_B_m(self) -> Array:
        """(3,) horizontal displacement of the tool in the hand since the first measurement, at most
        `MAX_DISPLACEMENT_M`; zero if it is not known."""
        if self._now_B_m is None or self._first_B_m is None:
            return np.zeros(3)
        moved = self._now_B_m - self._first_B_m
        length = float(np.linalg.norm(moved))
        return np.array([*(moved * min(1.0, MAX_DISPLACEMENT_M / max(length, 1e-12))), 0.0])

    @property
    def tip_B_m(self) -> Array:
        """(3,) horizontal offset of the held tool's tip from P by the last measurement; zero if it is not known."""
        return np.zeros(3) if self._now_B_m is None else np.array([*self._now_B_m, 0.0])

    def state(self) -> dict[str, Any]:
        """Return the record, for `restore`."""
        return {"first_B_m": self._first_B_m, "now_B_m": self._now_B_m}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a `state`."""
        known = (state["first_B_m"], state["now_B_m"])
        first, now = (None if v is None else np.array(v, dtype=np.float64).reshape(2) for v in known)
        self._first_B_m, self._now_B_m = first, now
