"""A robot that feels what a test says, and plans from text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from glotouch_bt.faults import FaultInjector
from glotouch_bt.faults.plan import FaultPlan, check_plan
from glotouch_bt.mission.read.yaml_source import parse_yaml
from glotouch_bt.robot import HOLD, Array, Command, Observation
from glotouch_bt.robot.fake import FakeRobot


def wave(stamp_s: Array, position: Array, quat: Array) -> Array:
    """A wrench that differs in every sample and component."""
    return np.sin(np.outer(stamp_s, np.arange(1.0, 7.0)) * 7.0) + np.arange(6.0)


def plan_of(text: str) -> FaultPlan:
    """A plan from the lines of its list."""
    return check_plan(parse_yaml(f"faults: test\nplan:\n{text}", "plan.yaml"))


class Pair:
    """The same commands to a robot alone and to one with faults."""

    def __init__(self, text: str, seed: int = 1, **options: Any) -> None:
        options.setdefault("wrench", wave)
        self.alone, self.device = FakeRobot(**options), FakeRobot(**options)
        self.injector = FaultInjector(self.device, plan_of(text), seed)
        self.proof = self.injector.proofs()[0]

    def cycles(self, n: int, command: Command = HOLD) -> Iterator[tuple[Observation, Observation]]:
        """(true, reported) blocks."""
        for _ in range(n):
            yield self.alone.cycle(command), self.injector.cycle(command)

    def wrenches(self, n: int) -> tuple[Array, Array]:
        """(true, reported) wrenches of n periods, each (10 n, 6)."""
        both = list(self.cycles(n))
        return np.concatenate([t.wrench_S for t, _ in both]), np.concatenate([r.wrench_S for _, r in both])


@pytest.fixture
def pair() -> Callable[..., Pair]:
    return Pair
