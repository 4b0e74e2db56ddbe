"""Proof that each axis of the conditions altered the model or a reading: an axis without effect is an error."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, Conditions
from glotouch_bt.robot.scene import AXES

Value = float | Array


class AxisProof:
    """Record of the axes that are set: which were used, and which altered a value. An axis is used once its model ran.

    Args:
        conditions: The disturbances; axes at their defaults are not judged.
    """

    def __init__(self, conditions: Conditions) -> None:
        chosen = conditions.axes_set()
        self._open = {name: i for i, name in enumerate(AXES) if name in chosen}
        self._used = np.zeros(len(AXES), dtype=bool)
        self._altered = np.zeros(len(AXES), dtype=bool)

    def saw(self, axis: str, before: Value, after: Value) -> None:
        """Note a value before and after an axis acted on it (shapes may broadcast); a difference is an effect."""
        index = self._open.get(axis)
        if index is None or self._altered[index]:
            return
        self._used[index] = True
        self._altered[index] = bool(np.not_equal(before, after).any())

    def silent(self) -> tuple[str, ...]:
        """Return the axes that were used and altered nothing."""
        return tuple(name for name, i in self._open.items() if self._used[i] and not self._altered[i])
