"""Base of all effects: an effect alters commands to the device, observations from it, or the simulated world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, Generic, TypeVar, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict

from glotouch_bt.robot import SAMPLED, Array, BadInput, Command, Observation, Request, RobotDescription, Ticket
from glotouch_bt.robot.simulation import Disturber
from glotouch_bt.skill import param

__all__ = ["Effect", "EffectContext", "FaultParams", "P", "param"]

Cycle = Callable[[Command], Observation]


class FaultParams(BaseModel):
    """Base of every fault's parameters. YAML keys are the field names; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


P = TypeVar("P", bound=FaultParams)


@dataclass
class EffectContext:
    """Inputs of an effect.

    Attributes:
        rng: The fault's own random generator.
        period_s: Control period.
        description: Description of the robot.
        disturber: Access to the simulated world; None on hardware.
        sensed: The newest block as the device delivered it.
        may_kill: The process runs only this mission and may be killed.
    """

    rng: np.random.Generator
    period_s: float
    description: RobotDescription
    disturber: Disturber | None
    sensed: Observation
    may_kill: bool = False


@dataclass
class Actions:
    """Record of an effect beyond altered commands and observations.

    Attributes:
        count: Number of acts.
        moved_m: Distance by which it moved something in the world.
        notes: Notes for people.
    """

    count: int = 0
    moved_m: float = 0.0
    notes: list[str] = field(default_factory=list)


class Effect(Generic[P]):
    """The effect of one fault: `Effect[FaultParams]` or, with parameters of its own, `Effect[ItsParams]`.

    Every method has a default that changes nothing.

    Args:
        params: Parameters of the plan.
        context: Inputs of the effect.
    """

    Params: ClassVar[type[FaultParams]] = FaultParams
    drives: ClassVar[bool] = False
    """True for effects that override `drive`."""

    def __init_subclass__(cls) -> None:
        for base in cls.__dict__.get("__orig_bases__", ()):
            if isinstance(own := get_args(base)[0], type):
                cls.Params = own

    def __init__(self, params: P, context: EffectContext) -> None:
        self.params, self.context, self.actions = params, context, Actions()

    def prepare(self) -> None:
        """Prepare before the first cycle, whenever the fault starts."""

    def begin(self) -> None:
        """Start the fault."""

    def end(self) -> None:
        """End the fault; permanent changes stay."""

    def command(self, command: Command) -> Command:
        """Return the command that the device gets instead."""
        return command

    def drive(self, cycle: Cycle, command: Command) -> Observation:
        """Cycle the device (only if `drives`)."""
        return cycle(command)

    def sense(self, observation: Observation) -> Observation:
        """Return the observation that is reported instead."""
        return observation

    def refuse(self) -> None:
        """Raise if robot calls other than `cycle` fail, too."""

    def tared(self) -> None:
        """React to a tare that the device has just completed."""

    def request(self, request: Request) -> Ticket | None:
        """Answer a slow request in the device's place; None lets it pass."""
        return None


def rows_altered(before: Array, after: Array) -> int:
    """Return the number of rows in which two blocks (n, ...) differ; NaN differs from everything."""
    if before is after:
        return 0
    if before.shape != after.shape:
        return max(len(before), len(after))
    different = ~(before == after)
    return int(different.reshape(len(before), -1).any(axis=1).sum())


def samples_altered(before: Observation, after: Observation) -> int:
    """Return the number of differing samples: rows, the gripper state, the pair of depth maps."""
    if before is after:
        return 0
    rows = max(rows_altered(getattr(before, name), getattr(after, name)) for name in SAMPLED)
    jaws = int(before.gripper != after.gripper)
    one, two = before.tactile, after.tactile
    if one is two:
        maps = 0
    elif one is None or two is None:
        maps = 1
    else:
        maps = int(bool(rows_altered(one.left_m, two.left_m) or rows_altered(one.right_m, two.right_m)))
    return rows + jaws + maps


def require_disturber(context: EffectContext) -> Disturber:
    """Return the access to the simulated world.

    Raises:
        BadInput: The backend offers none.
    """
    if context.disturber is None:
        raise BadInput("this fault changes the world itself: it needs a simulation backend that offers a disturber")
    return context.disturber
