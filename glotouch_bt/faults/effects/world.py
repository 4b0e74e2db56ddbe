"""Faults of the world itself, in simulation only: objects pushed, toppled, taken away or added, the container moved.

Nothing is moved through the robot, out of its jaws or away from under its touch: a jump of the world would press the
hand as nothing in the world can. So such a fault may have to wait; its report says for how long and for what.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from glotouch_bt.faults.effects.base import Effect, FaultParams, Scene, param, require_disturber
from glotouch_bt.robot import Array, Command, Observation
from glotouch_bt.robot.simulation import PathBlocked

Which = Literal["nearest", "farthest", "random"]
SLIDE_S = 0.5
"""A knocked object has come to rest by then."""
ASK_AGAIN_S = 0.05
"""A fault that has no room asks again after so long."""
WAYS = 12
"""So many directions, evenly spaced from the one that was drawn, are tried."""
WHICH = "Which object: nearest to or farthest from the pads, or any"


class ObjectParams(FaultParams):
    """Parameters of faults that choose an object."""

    which: Which = param(WHICH, default="nearest")


class WorldEffect(Effect):
    """Acts once: when it begins, or as soon after that as there is room."""

    def __init__(self, params: Any, scene: Scene) -> None:
        super().__init__(params, scene)
        self.hands = require_disturber(scene)
        self._why = ""

    def begin(self) -> None:
        """See `Effect`."""
        self._since_s = self.scene.sensed.now_s
        self.draw()
        self._try()

    def command(self, command: Command) -> Command:
        """See `Effect`; the command is left as it is."""
        if not self.acts.times and self.scene.sensed.now_s >= self._again_s - 1e-9:
            self._try()
        return command

    def end(self) -> None:
        """See `Effect`."""
        if not self.acts.times:
            self.acts.notes.append(f"never had room: {self._why}")

    def draw(self) -> None:
        """Choose what shall happen, once."""

    def act(self) -> None:
        """Do it, and count it.

        Raises:
            PathBlocked: Not now.
        """
        raise NotImplementedError

    def _try(self) -> None:
        now_s = self.scene.sensed.now_s
        try:
            self.act()
        except PathBlocked as e:
            self._why, self._again_s = str(e), now_s + ASK_AGAIN_S
            return
        if self._why:
            self.acts.notes.append(f"after {now_s - self._since_s:.2f} s without room: {self._why}")

    def some_way(self, first_rad: float, go: Callable[[float], object]) -> None:
        """Go in the drawn direction, or in the nearest to it that has room.

        Raises:
            PathBlocked: None has; why the first has not.
        """
        refused: PathBlocked | None = None
        for k in range(WAYS):
            turn = (k + 1) // 2 * (1 if k % 2 else -1)
            try:
                go(first_rad + turn * 2.0 * math.pi / WAYS)
                return
            except PathBlocked as e:
                refused = refused or e
        assert refused is not None
        raise refused

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
    """An object is knocked and slides: some 20 mm at 0.5 m/s, in a random direction, but not into the robot."""

    Params = ShoveParams
    params: ShoveParams

    def draw(self) -> None:
        """See `WorldEffect`."""
        self._index, self._angle = self.chosen(self.params.which), float(self.scene.rng.uniform(-np.pi, np.pi))
        self._until_s = -math.inf

    def act(self) -> None:
        """See `WorldEffect`."""
        speed = self.params.speed_m_s
        self._before = self.hands.places_B_m()
        self.some_way(self._angle, lambda a: self.hands.shove(self._index, speed * np.array([np.cos(a), np.sin(a)])))
        self._until_s = self.scene.sensed.now_s + SLIDE_S
        self.note(self._index, self._before, f"shoved at {speed:g} m/s")

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`; nothing is altered, how far it slid is measured."""
        if observation.now_s < self._until_s:
            slid = float(np.linalg.norm((self.hands.places_B_m() - self._before)[self._index]))
            self.acts.moved_m = max(self.acts.moved_m, slid)
        return observation


class Topple(WorldEffect):
    """An object is laid on its side, where there is room for that."""

    Params = ObjectParams
    params: ObjectParams

    def draw(self) -> None:
        """See `WorldEffect`."""
        self._index, self._angle = self.chosen(self.params.which), float(self.scene.rng.uniform(-np.pi, np.pi))

    def act(self) -> None:
        """See `WorldEffect`."""
        before = self.hands.places_B_m()
        self.some_way(self._angle, lambda a: self.hands.topple(self._index, a))
        self.note(self._index, before, "toppled")


class Remove(WorldEffect):
    """An object is taken away."""

    Params = ObjectParams
    params: ObjectParams

    def draw(self) -> None:
        """See `WorldEffect`."""
        self._index = self.chosen(self.params.which)

    def act(self) -> None:
        """See `WorldEffect`."""
        before = self.hands.places_B_m()
        self.hands.remove(self._index)
        self.note(self._index, before, "taken away")


class Add(WorldEffect):
    """An object that was not there at first is put where its layout has it."""

    Params = ObjectParams
    params: ObjectParams

    def prepare(self) -> None:
        """See `Effect`."""
        self._index = self.chosen(self.params.which)
        self.hands.remove(self._index)

    def act(self) -> None:
        """See `WorldEffect`."""
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

    def act(self) -> None:
        """See `WorldEffect`."""
        p = self.params
        self.hands.shift_container(np.array(p.shift_m), p.yaw_rad)
        self.acts.times += 1
        self.acts.moved_m = float(np.hypot(*p.shift_m))
        self.acts.notes.append(f"container moved by {1e3 * self.acts.moved_m:.1f} mm")
