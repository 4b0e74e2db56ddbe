"""Faults of the simulated world: objects are pushed, toppled, removed or added, the container is moved.

Nothing is moved through the robot, out of its jaws or away from under its touch, because such a jump would cause forces
that no real event causes. A fault may therefore have to wait; its report says how long and why.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from glotouch_bt.faults.effects.base import Effect, EffectContext, FaultParams, P, param, require_disturber
from glotouch_bt.robot import Array, Command, Observation
from glotouch_bt.robot.simulation import PathBlocked

Which = Literal["nearest", "farthest", "random"]
SLIDE_S = 0.5
"""Time after which a knocked object has come to rest."""
RETRY_S = 0.05
"""Time after which a blocked fault is tried again."""
DIRECTIONS = 12
"""Number of evenly spaced directions that are tried, from the drawn one on."""


class ObjectParams(FaultParams):
    """Parameters of faults that choose an object."""

    which: Which = param("Object: nearest to or farthest from the pads, or any", default="nearest")


class WorldEffect(Effect[P]):
    """Actions once: when it begins, or as soon after that as there is room."""

    def __init__(self, params: P, context: EffectContext) -> None:
        super().__init__(params, context)
        self.disturber = require_disturber(context)
        self._obstacle = ""

    def begin(self) -> None:
        """See `Effect`."""
        self._since_s = self.context.sensed.now_s
        self.draw()
        self._try()

    def command(self, command: Command) -> Command:
        """See `Effect`. The command is not altered."""
        if not self.actions.count and self.context.sensed.now_s >= self._again_s - 1e-9:
            self._try()
        return command

    def end(self) -> None:
        """See `Effect`."""
        if not self.actions.count:
            self.actions.notes.append(f"never had room: {self._obstacle}")

    def draw(self) -> None:
        """Draw the random choices, once."""

    def act(self) -> None:
        """Change the world and count it.

        Raises:
            PathBlocked: It is not possible now.
        """
        raise NotImplementedError

    def _try(self) -> None:
        now_s = self.context.sensed.now_s
        try:
            self.act()
        except PathBlocked as e:
            self._obstacle, self._again_s = str(e), now_s + RETRY_S
            return
        if self._obstacle:
            self.actions.notes.append(f"after {now_s - self._since_s:.2f} s without room: {self._obstacle}")

    def try_directions(self, first_rad: float, go: Callable[[float], object]) -> None:
        """Call `go` with the drawn direction, or with the nearest to it that has room.

        Raises:
            PathBlocked: No direction has room; says why the first has none.
        """
        refused: PathBlocked | None = None
        for k in range(DIRECTIONS):
            turn = (k + 1) // 2 * (1 if k % 2 else -1)
            try:
                go(first_rad + turn * 2.0 * math.pi / DIRECTIONS)
                return
            except PathBlocked as e:
                refused = refused or e
        assert refused is not None
        raise refused

    def chosen(self, which: Which) -> int:
        """Return the index of the object that the plan names."""
        places = self.disturber.places_B_m()
        if which == "random":
            return int(self.context.rng.integers(len(places)))
        away = np.linalg.norm(places[:, :2] - self.context.sensed.position_B_P[-1, :2], axis=1)
        return int(away.argmin() if which == "nearest" else away.argmax())

    def note(self, index: int, before_B_m: Array, what: str) -> None:
        """Note what was done to an object."""
        moved = float(np.linalg.norm(self.disturber.places_B_m()[index] - before_B_m[index]))
        self.actions.moved_m = max(self.actions.moved_m, moved)
        self.actions.count += 1
        self.actions.notes.append(f"object {index} {what}")


class ObjectShovedParams(ObjectParams):
    """Parameters of `object_shoved`."""

    speed_m_s: float = param("Speed after the knock", unit="m/s", default=0.5, gt=0.0, le=3.0)


class ObjectShoved(WorldEffect[ObjectShovedParams]):
    """An object is knocked and slides in a random direction away from the robot, about 20 mm at 0.5 m/s."""

    def draw(self) -> None:
        """See `WorldEffect`."""
        self._index, self._angle = self.chosen(self.params.which), float(self.context.rng.uniform(-np.pi, np.pi))
        self._until_s = -math.inf

    def act(self) -> None:
        """See `WorldEffect`."""
        speed = self.params.speed_m_s
        self._before = self.disturber.places_B_m()
        self.try_directions(
            self._angle, lambda a: self.disturber.shove(self._index, speed * np.array([np.cos(a), np.sin(a)]))
        )
        self._until_s = self.context.sensed.now_s + SLIDE_S
        self.note(self._index, self._before, f"shoved at {speed:g} m/s")

    def sense(self, observation: Observation) -> Observation:
        """See `Effect`. Alters nothing; measures how far the object slid."""
        if observation.now_s < self._until_s:
            slid = float(np.linalg.norm((self.disturber.places_B_m() - self._before)[self._index]))
            self.actions.moved_m = max(self.actions.moved_m, slid)
        return observation


class ObjectToppled(WorldEffect[ObjectParams]):
    """An object is laid on its side where there is room."""

    def draw(self) -> None:
        """See `WorldEffect`."""
        self._index, self._angle = self.chosen(self.params.which), float(self.context.rng.uniform(-np.pi, np.pi))

    def act(self) -> None:
        """See `WorldEffect`."""
        before = self.disturber.places_B_m()
        self.try_directions(self._angle, lambda a: self.disturber.topple(self._index, a))
        self.note(self._index, before, "toppled")


class ObjectRemoved(WorldEffect[ObjectParams]):
    """An object is removed."""

    def draw(self) -> None:
        """See `WorldEffect`."""
        self._index = self.chosen(self.params.which)

    def act(self) -> None:
        """See `WorldEffect`."""
        before = self.disturber.places_B_m()
        self.disturber.remove(self._index)
        self.note(self._index, before, "taken away")


class ObjectAdded(WorldEffect[ObjectParams]):
    """An object missing at first is put at its place of the layout."""

    def prepare(self) -> None:
        """See `Effect`."""
        self._index = self.chosen(self.params.which)
        self.disturber.remove(self._index)

    def act(self) -> None:
        """See `WorldEffect`."""
        before = self.disturber.places_B_m()
        self.disturber.put_back(self._index)
        self.note(self._index, before, "added")


Shift = Annotated[float, Field(ge=-1.0, le=1.0)]
"""Shift of the container along one axis, m: at most about its own size."""


class ContainerOffsetParams(FaultParams):
    """Parameters of `container_offset`."""

    shift_m: tuple[Shift, Shift] = param("Shift of the container in B", unit="m", default=(0.01, 0.005))
    yaw_rad: float = param("Rotation about its middle", unit="rad", default=0.0, ge=-0.5, le=0.5)


class ContainerOffset(WorldEffect[ContainerOffsetParams]):
    """The container is moved with its content."""

    def act(self) -> None:
        """See `WorldEffect`."""
        p = self.params
        self.disturber.shift_container(np.array(p.shift_m), p.yaw_rad)
        self.actions.count += 1
        self.actions.moved_m = float(np.hypot(*p.shift_m))
        self.actions.notes.append(f"container moved by {1e3 * self.actions.moved_m:.1f} mm")
