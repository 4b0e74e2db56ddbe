"""Displacement of the held tool since it was first measured, so that it is put back where it stood."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from glotouch_bt.robot import Array

MAX_DISPLACEMENT_M = 0.0015
"""Largest displacement to correct. Source: ours; the overlap of the simulated holder's rails with the handle. Beyond
it, the handle has left its rails and is tilted."""


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

    def state(self) -> dict[str, Any]:
        """Return the record, for `restore`."""
        return {"first_B_m": self._first_B_m, "now_B_m": self._now_B_m}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a `state`."""
        known = (state["first_B_m"], state["now_B_m"])
        first, now = (None if v is None else np.array(v, dtype=np.float64).reshape(2) for v in known)
        self._first_B_m, self._now_B_m = first, now
