"""When a fault begins and ends: a moment, a node that runs, a call of the seam, a condition on what is sensed."""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from glotouch_bt.robot import Observation
from glotouch_bt.skill import param


class When(BaseModel):
    """All that is given must hold at once, at the beginning of a control period; nothing given: from the start."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    time_s: float | None = param("Robot time since the mission began", unit="s", default=None, ge=0.0)
    node: str | None = param("A node runs: name or path, with * and ?", default=None, min_length=1)
    visit: int = param("It runs for the n-th time, or a later one", default=1, ge=1)
    after_s: float = param("It has run for so long", unit="s", default=0.0, ge=0.0)
    cycle: int | None = param("Control periods done", default=None, ge=0)
    call: int | None = param("Calls of the seam done: observe, cycle, start", default=None, ge=0)
    force_above_N: float | None = param("The device's force, norm of the newest sample", unit="N", default=None, ge=0.0)
    force_below_N: float | None = param("The same", unit="N", default=None, ge=0.0)
    aperture_above_m: float | None = param("The device's aperture", unit="m", default=None, ge=0.0)
    aperture_below_m: float | None = param("The same", unit="m", default=None, ge=0.0)
    height_below_m: float | None = param("Height of the pads' mid-point in B", unit="m", default=None)


class Lasting(BaseModel):
    """How long a fault lasts; one of these."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    duration_s: float | None = param("Robot time", unit="s", default=None, gt=0.0)
    cycles: int | None = param("Control periods", default=None, ge=1)
    until: Literal["node", "ever"] | None = Field(default=None, description="node: until that node ends; ever: no end")


class Repeat(BaseModel):
    """How often a fault comes."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    times: int = param("How often at most", default=1, ge=1, le=100_000)
    every_s: float = param("Least time between two beginnings", unit="s", default=0.0, ge=0.0)


@dataclass
class Moment:
    """What triggers look at; the injector keeps it up to date.

    Attributes:
        start_s: Robot clock at the start.
        sensed: The newest block as the device delivered it.
        cycles, calls: Control periods and calls of the seam so far.
        running: Since when each running node runs, by path.
        visits: How often each node has begun.
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
    """True if a node's path, or its name, fits a pattern."""
    return fnmatchcase(path, pattern) or fnmatchcase(path.rsplit("/", 1)[-1], pattern)


def running_node(when: When, moment: Moment) -> str | None:
    """Path of the running node a trigger waits for, if it has run as often and as long as asked."""
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


def holds(when: When, moment: Moment) -> bool:
    """True if the fault shall begin now (the node apart, see `running_node`)."""
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
