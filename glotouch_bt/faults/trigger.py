"""Triggers: when a fault starts and ends, by time, running node, number of calls, or sensed values."""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from glotouch_bt.robot import Observation
from glotouch_bt.skill import param

MAX_TIME_S = 86_400.0
"""Longest time in a plan; no mission may last longer."""
MAX_COUNT = 10_000_000
"""Largest count of periods or calls in a plan: as many as such a mission has."""
MAX_FORCE_N = 10_000.0
"""Largest threshold of a force."""


class When(BaseModel):
    """Start condition. All given keys must hold at the start of a control period; without keys it holds at once."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    time_s: float | None = param("Robot time since the mission began", unit="s", default=None, ge=0.0, le=MAX_TIME_S)
    node: str | None = param("This node runs: name or path, with * and ?", default=None, min_length=1, max_length=200)
    visit: int = param("It runs for at least the n-th time", default=1, ge=1, le=MAX_COUNT)
    after_s: float = param("It has run for this long", unit="s", default=0.0, ge=0.0, le=MAX_TIME_S)
    cycle: int | None = param("Number of control periods done", default=None, ge=0, le=MAX_COUNT)
    call: int | None = param("Number of robot calls done: observe, cycle, start", default=None, ge=0, le=MAX_COUNT)
    force_above_N: float | None = param(
        "Sensed force (newest sample) is above", unit="N", default=None, ge=0.0, le=MAX_FORCE_N
    )
    force_below_N: float | None = param("Sensed force is below", unit="N", default=None, ge=0.0, le=MAX_FORCE_N)
    aperture_above_m: float | None = param("Sensed aperture is above", unit="m", default=None, ge=0.0, le=1.0)
    aperture_below_m: float | None = param("Sensed aperture is below", unit="m", default=None, ge=0.0, le=1.0)
    height_below_m: float | None = param(
        "Height of the pads' mid-point in B is below", unit="m", default=None, ge=-10.0, le=10.0
    )


class Duration(BaseModel):
    """Duration of a fault: exactly one of the keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    duration_s: float | None = param("Robot time", unit="s", default=None, gt=0.0, le=MAX_TIME_S)
    cycles: int | None = param("Control periods", default=None, ge=1, le=MAX_COUNT)
    until: Literal["node", "ever"] | None = Field(default=None, description="node: until it ends; ever: without end")


class Repeat(BaseModel):
    """Repetition of a fault."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    times: int = param("Largest number of starts", default=1, ge=1, le=100_000)
    every_s: float = param("Least time between two starts", unit="s", default=0.0, ge=0.0, le=MAX_TIME_S)


@dataclass
class TriggerState:
    """The state that triggers are evaluated on; updated by the injector.

    Attributes:
        start_s: Robot clock at the start.
        sensed: The newest block as the device delivered it.
        cycles, calls: Control periods and robot calls so far.
        running: Robot clock at which each running node started, by path.
        visits: Number of starts of each node, by path.
    """

    start_s: float
    sensed: Observation
    cycles: int = 0
    calls: int = 0
    running: dict[str, float] = field(default_factory=dict)
    visits: dict[str, int] = field(default_factory=dict)

    @property
    def now_s(self) -> float:
        """Robot clock."""
        return self.sensed.now_s


def matches(path: str, pattern: str) -> bool:
    """Return True if a node's path or name matches a pattern."""
    return fnmatchcase(path, pattern) or fnmatchcase(path.rsplit("/", 1)[-1], pattern)


def running_node(when: When, moment: TriggerState) -> str | None:
    """Return the path of the running node that satisfies a trigger, or None."""
    if when.node is None:
        return None
    for path, since_s in moment.running.items():
        if (
            moment.visits[path] >= when.visit
            and moment.now_s - since_s >= when.after_s - 1e-9
            and matches(path, when.node)
        ):
            return path
    return None


def condition_holds(when: When, moment: TriggerState) -> bool:
    """Return True if every condition except the node holds; for the node see `running_node`."""
    if when.time_s is not None and moment.now_s - moment.start_s < when.time_s - 1e-9:
        return False
    if when.cycle is not None and moment.cycles < when.cycle:
        return False
    if when.call is not None and moment.calls < when.call:
        return False
    sensed = moment.sensed
    if when.force_above_N is not None or when.force_below_N is not None:
        force = float(np.linalg.norm(sensed.wrench_S[-1, :3]))
        if not _within(force, when.force_above_N, when.force_below_N):
            return False
    if not _within(sensed.gripper.aperture_m, when.aperture_above_m, when.aperture_below_m):
        return False
    return when.height_below_m is None or float(sensed.position_B_P[-1, 2]) < when.height_below_m


def _within(value: float, above: float | None, below: float | None) -> bool:
    return (above is None or value > above) and (below is None or value < below)
