"""A mission's run without an arm, as the fixture `go`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.execution import Outcome, run_mission
from glotouch_bt.mission.record import NullRecord


@pytest.fixture
def go(load: Callable[..., Any], robot: Any, no_arm: Any) -> Callable[..., Outcome]:
    def run(tree: str, record: Any = None, **options: Any) -> Outcome:
        return run_mission(load(tree), robot, record or NullRecord(), make_arm=no_arm, **options)

    return run
