"""Faults of the world itself, in simulation only: objects pushed, toppled, taken away or added, the container moved."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from glotouch_bt.faults.effect import Effect, FaultParams, Scene, param, require_disturber
from glotouch_bt.robot import Array, Observation

Which = Literal["nearest", "farthest", "random"]
SLIDE_S = 0.5
"""A knocked object has come to rest by then."""
WHICH = "Which object: nearest to or farthest from the pads, or any"


class ObjectParams(FaultParams):
    """Parameters of faults that choose an object."""

    which: Which = param(WHICH, default="nearest")


class WorldEffect(Effect):
    """Acts once when it begins."""

    def __init__(self, params: Any, scene: Scene) -> None:
        super().__init__(params, scene)
        self.hands = require_disturber(scene)

    def chosen(self, which: Which) -> int:
        """Index of the object the plan means."""
        places = self.hands.places_B_m()
        if which == "random":
            return int(self.scene.rng.integers(len(places)))
        away = np.linalg.norm(places[:, :2] - self.scene.sensed.position_B_P[-1, :2], axis=1)
        return int(away.argmin() if which == "nearest" else away.argmax())

    def note(self, index: int, before_B_m: Array, what: str) -> None:
        """Write down what was done to an object."""
        moved = float(np.linalg.norm(self.hands.places_B_m()[index] - before_B_m[index]))
        self.acts.moved_m = max(self.acts.moved_m, moved)
        self.acts.times += 1
        self.acts.notes.append(f"object {index} {what}")


class ShoveParams(ObjectParams):
    """Parameters of `object_shoved`."""

    speed_m_s: float = param("Speed the knock gives it", unit="m/s", default=0.5, gt=0.0, le=3.0)


class Shove(WorldEffect):
    """An object is knocked and slides in a random direction: some 20 mm at 0.5 m/s."""

    Params = ShoveParams
    params: ShoveParams

    def begin(self) -> None:
        """See `Effect`."""
        index, angle = self.chosen(self.params.which), float(self.scene.rng.uniform(-np.pi, np.pi))
        self._index, self._before, self._until_s = index, self.hands.places_B_m(), self.scene.sensed.now_s + SLIDE_S
        self.hands.shove(index, self.params.speed_m_s * np.array([np.cos(angle), np.sin(angle)]))
        self.note(index, self._before, f"shoved at {self.params.speed_m_s:g} m/s")

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`; nothing is altered, how far it slid is measured."""
        if observation.now_s < self._until_s:
            slid = float(np.linalg.norm((self.hands.places_B_m() - self._before)[self._index]))
            self.acts.moved_m = max(self.acts.moved_m, slid)
        return observation


class Topple(WorldEffect):
    """An object is laid on its side."""

    Params = ObjectParams
    params: ObjectParams

    def begin(self) -> None:
        """See `Effect`."""
        index = self.chosen(self.params.which)
        before = self.hands.places_B_m()
        self.hands.topple(index, float(self.scene.rng.uniform(-np.pi, np.pi)))
        self.note(index, before, "toppled")


class Remove(WorldEffect):
    """An object is taken away."""

    Params = ObjectParams
    params: ObjectParams

    def begin(self) -> None:
        """See `Effect`."""
        index, before = self.chosen(self.params.which), self.hands.places_B_m()
        self.hands.remove(index)
        self.note(index, before, "taken away")


class Add(WorldEffect):
    """An object that was not there at first is put where its layout has it."""

    Params = ObjectParams
    params: ObjectParams

    def prepare(self) -> None:
        """See `Effect`."""
        self._index = self.chosen(self.params.which)
        self.hands.remove(self._index)

    def begin(self) -> None:
        """See `Effect`."""
        before = self.hands.places_B_m()
        self.hands.put_back(self._index)
        self.note(self._index, before, "added")


class OffsetParams(FaultParams):
    """Parameters of `container_offset`."""

    shift_m: tuple[float, float] = param("How far the container is moved, in B", unit="m", default=(0.01, 0.005))
    yaw_rad: float = param("and turned about its middle", unit="rad", default=0.0, ge=-0.5, le=0.5)


class ContainerOffset(WorldEffect):
    """The container is moved, with all that is in it; nobody is told."""

    Params = OffsetParams
    params: OffsetParams

    def begin(self) -> None:
        """See `Effect`."""
        p = self.params
        self.hands.shift_container(np.array(p.shift_m), p.yaw_rad)
        self.acts.times += 1
        self.acts.moved_m = float(np.hypot(*p.shift_m))
        self.acts.notes.append(f"container moved by {1e3 * self.acts.moved_m:.1f} mm")
