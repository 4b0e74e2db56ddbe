"""A running skill that is updated alone leaves the tree as whole ticks do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import py_trees
import pytest
from py_trees.common import Status

from glotouch_bt.mission.nodes.timeout import ClockTimeout
from glotouch_bt.mission.tree import RunningSkill
from glotouch_bt.robot import HOLD
from glotouch_bt.skill import Context, Skill, SkillParams, SkillRun


@dataclass
class Clock:
    mission_s: float = 0.0
    preempted: bool = False
    observation: Any = None
    command: Any = HOLD
    arm: Any = None

    def __post_init__(self) -> None:
        self.arm = self
        self.not_run: list[str] = []


class Waits(Skill):
    """Waits some periods. SUCCESS: it has waited."""

    periods = 5

    def run(self) -> SkillRun:
        for _ in range(self.periods):
            yield HOLD


def history(seconds: float, *, alone: bool) -> list[tuple[Status, ...]]:
    clock = Clock()
    context = cast("Context", clock)
    waits = [Waits(name, SkillParams(), context) for name in ("first", "second")]
    for skill in waits:
        skill.setup_ports({})
    timeout = ClockTimeout("timeout", waits[1], seconds, lambda: clock.mission_s)
    root = py_trees.composites.Sequence("root", memory=True, children=[waits[0], timeout])
    running, seen = RunningSkill(root), []
    for tick in range(20):
        clock.mission_s = 0.01 * tick
        if not (alone and running.keeps_running()):
            root.tick_once()
            running.find()
        seen.append(tuple(node.status for node in root.iterate()))
        if root.status is not Status.RUNNING:
            break
    return seen


@pytest.mark.parametrize("seconds", [0.02, 1.0])
def test_it_ends_in_the_same_tick(seconds: float) -> None:
    """By itself, and by a timeout above it."""
    whole = history(seconds, alone=False)
    assert history(seconds, alone=True) == whole
    assert whole[-1][-1 if seconds < 1.0 else 0] in (Status.FAILURE, Status.SUCCESS, Status.INVALID)
