"""Scripted leaves for the specification of glotouch_missions/retrieve.yaml."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.read.library import SkillRegistry
from glotouch_bt.mission_testing import ScriptedRun, ok, stand_in
from glotouch_bt.perception.touch import Candidate

SWEEP, JAWS, TAKE = "*/explore/*", "*/squeeze_all/*", "*/take_target/*"
IN_ORDER, GO_ON = "*/bring the probe in order/*", "*/go on with what was found/stow*"
FELT, LAST_CHECK = "*/bring the probe in order/tool_check*", "*/with the probe/tool_check*"
SAFE_END = "*/end safely/stow*"
SHELF = SkillRegistry()

Run = Callable[..., ScriptedRun]


@pytest.fixture
def retrieve(scripted: Any) -> Run:
    """Run the mission with a script; all that is not scripted succeeds, and what is swept is one object."""

    def run(script: dict[str, Any] | None = None, **settings: Any) -> ScriptedRun:
        done: ScriptedRun = scripted("retrieve", script or {}, settings=settings)
        return done

    return run


def each_code(skill: str) -> pytest.MarkDecorator:
    """For every way a skill declares to fail."""
    return pytest.mark.parametrize("code", list(SHELF[skill].failures()))


def candidates(*qualities: float) -> tuple[Candidate, ...]:
    return tuple(stand_in(Candidate, index=i, quality=q) for i, q in enumerate(qualities))


def found(n: int, **ports: Any) -> Any:
    """Return orbit_probe's answer when this many objects are known."""
    return ok(candidates=candidates(*[0.5] * n), found=n, **ports)


def skills(run: ScriptedRun, pattern: str) -> list[str]:
    """The skills that some leaves called, in order."""
    return [c.skill for c in run.calls_of(pattern)]


def ended(run: ScriptedRun) -> bool:
    """The last thing it did was to stow, once."""
    return run.calls[-1].path in {c.path for c in run.calls_of(SAFE_END)} and run.ran(SAFE_END) == 1


def safely(run: ScriptedRun, code: str) -> bool:
    """It failed for this reason, and ended safely."""
    return run.failed_with(code) and ended(run)
