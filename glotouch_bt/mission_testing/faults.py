"""Faults round a test's robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.faults import FaultInjector, check_plan, read_plan
from glotouch_bt.mission.read import parse_yaml
from glotouch_bt.robot import Robot


def faulted(plan: Sequence[Mapping[str, Any]] | str | Path, robot: Robot, seed: int = 0) -> FaultInjector:
    """A robot with faults.

    Args:
        plan: Faults as in a plan's `plan`, or the path or shipped name of a plan.
        robot: Any robot.
        seed: Of the faults' draws.

    Raises:
        BadInput: Everything that is wrong with the plan.
    """
    if isinstance(plan, str | Path):
        return FaultInjector(robot, read_plan(plan), seed)
    text = yaml.safe_dump({"faults": "test", "plan": [dict(fault) for fault in plan]})
    return FaultInjector(robot, check_plan(parse_yaml(text, "faulty(...)")), seed)


def idle(injector: FaultInjector) -> list[str]:
    """Names of the faults that changed nothing."""
    return [proof.spec.name for proof in injector.proofs() if proof.changes == 0]
