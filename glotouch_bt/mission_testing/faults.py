"""Inject faults into a test's robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.faults import FaultInjector, check_plan, read_plan
from glotouch_bt.mission.read import parse_yaml
from glotouch_bt.robot import Robot


def faulted(plan: Sequence[Mapping[str, Any]] | str | Path, robot: Robot, seed: int = 0) -> FaultInjector:
    """Wrap a robot with a fault injector.

    Args:
        plan: Faults as in a plan's `plan`, or the path or shipped name of a plan.
        robot: Any robot.
        seed: Seed of the faults' random draws.

    Raises:
        BadInput: All faults of the plan.
    """
    if isinstance(plan, str | Path):
        return FaultInjector(robot, read_plan(plan), seed)
    text = yaml.safe_dump({"faults": "test", "plan": [dict(fault) for fault in plan]})
    return FaultInjector(robot, check_plan(parse_yaml(text, "faulty(...)")), seed)


def idle(injector: FaultInjector) -> list[str]:
    """Return the names of faults that altered nothing."""
    return [proof.spec.name for proof in injector.proofs() if proof.changes == 0]
