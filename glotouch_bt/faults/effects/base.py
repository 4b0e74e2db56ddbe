"""What a fault does while it lasts: it changes what goes to the device, what comes from it, or the world itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict

from glotouch_bt.robot import Array, BadInput, Command, Observation, Request, RobotDescription, Ticket
from glotouch_bt.robot.simulation import Disturber
from glotouch_bt.skill import param

__all__ = ["Effect", "FaultParams", "Scene", "param"]

Cycle = Callable[[Command], Observation]


class FaultParams(BaseModel):
    """Base of every fault's parameters; YAML keys are the field names. Unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


@dataclass
class Scene:
    """What an effect may look at.

    Attributes:
        rng: The fault's own random draws.
        period_s: Control period.
        description: The robot as numbers.
        disturber: Hands inside the simulated world; None on hardware.
        sensed: The newest block as the device delivered it.
        may_kill: The process may be killed (it is the mission's own).
    """

    rng: np.random.Generator
    period_s: float
    description: RobotDescription
    disturber: Disturber | None
    sensed: Observation
    may_kill: bool = False


@dataclass
class Acts:
    """What an effect did that cannot be seen by comparing what went in with what came out.

    Attributes:
        times: How often it acted.
        moved_m: How far it moved something in the world.
        notes: In words.
    """

    times: int = 0
    moved_m: float = 0.0
    notes: list[str] = field(default_factory=list)


class Effect:
    """One fault at work. Every method has a default that changes nothing.

    Args:
        params: What the plan asks for.
        scene: What it may look at.
    """

    Params: ClassVar[type[FaultParams]] = FaultParams
    drives: ClassVar[bool] = False
    """True for effects that decide whether and how the device is cycled at all."""

    def __init__(self, params: Any, scene: Scene) -> None:
        self.params, self.scene, self.acts = params, scene, Acts()

    def prepare(self) -> None:
        """Before the first cycle, whenever the fault will begin."""

    def begin(self) -> None:
        """The fault begins."""

    def end(self) -> None:
        """The fault ends; what cannot be mended stays."""

    def command(self, command: Command) -> Command:
        """What the device is told instead."""
        return command

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """Cycle the device (only if `drives`)."""
        return cycle(command)

    def sense(self, observation: Observation) -> Observation:
        """What is said to have been sensed instead."""
        return observation

    def refuse(self) -> None:
        """Raise, if every call of the seam fails while the fault lasts; a call that is no cycle asks this only."""

    def tared(self) -> None:
        """The device has just zeroed its wrist sensor."""

    def request(self, request: Request) -> Ticket | None:
        """Answer a slow request in the device's place; None lets it pass."""
        return None


def rows_altered(before: Array, after: Array) -> int:
    """How many rows of two blocks (n, ...) differ; what is not a number differs from everything."""
    if before is after:
        return 0
    if before.shape != after.shape:
        return max(len(before), len(after))
    different = ~(before == after)
    return int(different.reshape(len(before), -1).any(axis=1).sum())


def samples_altered(before: Observation, after: Observation) -> int:
    """How many samples of a block differ: rows of the blocks, the gripper's report, the pair of depth maps."""
    if before is after:
        return 0
    rows = max(
        rows_altered(b, a)
        for b, a in (
            (before.stamp_s, after.stamp_s),
            (before.q, after.q),
            (before.dq, after.dq),
            (before.position_B_P, after.position_B_P),
            (before.quat_B_P, after.quat_B_P),
            (before.wrench_S, after.wrench_S),
        )
    )
    jaws = int(before.gripper != after.gripper)
    one, two = before.tactile, after.tactile
    if one is two:
        maps = 0
    elif one is None or two is None:
        maps = 1
    else:
        maps = int(bool(rows_altered(one.left_m, two.left_m) or rows_altered(one.right_m, two.right_m)))
    return rows + jaws + maps


def require_disturber(scene: Scene) -> Disturber:
    """The hands inside the world.

    Raises:
        BadInput: There are none: the backend is no simulation that offers them.
    """
    if scene.disturber is None:
        raise BadInput("this fault changes the world itself: it needs a simulation backend that offers a disturber")
    return scene.disturber
