"""Scripted leaves for the specification of glotouch_missions/retrieve_fixed.yaml and retrieve.yaml."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from glotouch_bt.mission.read.library import SkillRegistry
from glotouch_bt.mission_testing import Call, ScriptedRun, ok, stand_in
from glotouch_bt.perception.recognition import PARTS, ProbeTouch
from glotouch_bt.perception.touch import Candidate

SWEEP, JAWS, TAKE = "*/explore/*", "*/squeeze_all/*", "*/take_target/*"
IN_ORDER, GO_ON = "*/bring the probe in order/*", "*/go on with what was found/stow*"
FELT, LAST_CHECK = "*/bring the probe in order/tool_check*", "*/with the probe/tool_check*"
SAFE_END = "*/end safely/stow*"
SHELF = SkillRegistry()

Run = Callable[..., ScriptedRun]


@pytest.fixture
def retrieve(scripted: Any) -> Run:
    """Run `retrieve_fixed` with a script; all that is not scripted succeeds, and one object in free space is swept."""

    def run(script: dict[str, Any] | None = None, mission: str = "retrieve_fixed", **settings: Any) -> ScriptedRun:
        done: ScriptedRun = scripted(
            mission,
            {
                "next_probe*": measures(),
                "forget_doubtful*": forgets_nothing,
                "touch_next*": ok(lacks_space=False, in_doubt=0, absent=0.1),
                "grasp*": ok(lacks_space=False),
                **(script or {}),
            },
            settings=settings,
        )
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


def measures(*only: int, postponed: int = 0) -> Any:
    """Return next_probe's answers: each candidate's outline, then its top, the worst known first; `only` some of them.

    With a target, those left out count as excluded; but `postponed` of them may still be it.
    """

    def answer(call: Call) -> Any:
        new, tried = call.inputs.get("measured"), call.inputs.get("before") or ()
        known = tuple(new if new is not None and new.index == c.index else c for c in call.inputs["known"])
        done = {(t.candidate, t.part) for t in tried}
        left = [(c, part) for c in sorted(known, key=lambda c: c.quality) for part in PARTS]
        left = [(c, part) for c, part in left if (c.index, part) not in done]
        todo = [(c, part) for c, part in left if not (only and call.params.target) or c.index in only]
        c, part = todo[0] if todo else (known[0], "")
        probed = (*tried, ProbeTouch(c.index, part)) if todo else tried
        return ok(
            candidates=known, candidate=c, next_part=part, probed=probed, measured_enough=not todo, postponed=postponed,
            unmeasured=len({c.index for c, _ in left}),
        )  # fmt: skip

    return answer


def forgets_nothing(call: Call) -> Any:
    """Return forget_doubtful's answer when nothing is doubtful."""
    known, probed, felt = (call.inputs.get(port) or () for port in ("known", "before_probed", "felt"))
    return ok(forgotten=0, candidates=known, probed=probed, touchsets=felt, doubtful=())


def skills(run: ScriptedRun, pattern: str) -> list[str]:
    """The skills that some leaves called, in order."""
    return [c.skill for c in run.calls_of(pattern)]


def ended(run: ScriptedRun) -> bool:
    """The last thing it did was to stow, once."""
    return run.calls[-1].path in {c.path for c in run.calls_of(SAFE_END)} and run.ran(SAFE_END) == 1


def safely(run: ScriptedRun, code: str) -> bool:
    """It failed for this reason, and ended safely."""
    return run.failed_with(code) and ended(run)
