"""Faults in tests: they happen to scripted missions, when the node runs that they wait for, and must do something."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.load import Mission
from glotouch_bt.mission_testing import ok, run_scripted
from glotouch_bt.mission_testing.faults import faulted, idle
from glotouch_bt.robot import BadInput

TREE = "\n  - rest\n  - rest: {name: later}\n"
STOP = {"fault": "robot_fault", "when": {"node": "later", "after_s": "50 ms"}}


def test_a_fault_waits_for_its_node(
    mission: Callable[..., Mission], fake_robot: Callable[..., Any], faulty: Callable[..., Any]
) -> None:
    robot = faulty([STOP], fake_robot())
    run = run_scripted(mission(TREE), {"*": ok().after(0.2)}, robot=robot)
    assert run.status == "aborted"
    assert run.endings("rest") == ["SUCCESS"]
    assert run.endings("later") == ["PREEMPTED"]
    assert run.duration_s == pytest.approx(0.25, abs=0.03)
    (report,) = robot.report()
    assert report["applied"] == 1


def test_a_fault_that_does_nothing_is_known(mission: Callable[..., Mission], fake_robot: Callable[..., Any]) -> None:
    robot = faulted([STOP | {"when": {"node": "nobody"}}], fake_robot())
    run_scripted(mission(TREE), {"*": ok().after(0.05)}, robot=robot)
    assert idle(robot) == ["robot_fault"]


def test_a_plan_that_cannot_be_is_refused(fake_robot: Callable[..., Any]) -> None:
    with pytest.raises(BadInput, match="unknown fault 'robot_falt'; did you mean 'robot_fault'"):
        faulted([{"fault": "robot_falt"}], fake_robot())
