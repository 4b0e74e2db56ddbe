"""`bench faults --exhaustive`: fail the n-th call of the seam, n = 0, 1, ... until the mission makes no more calls."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glotouch_bt.faults.catalogue import CATALOGUE
from glotouch_bt.faults.injector import FaultInjector
from glotouch_bt.faults.listening import ListeningRecord
from glotouch_bt.faults.plan import FaultPlan, FaultSpec
from glotouch_bt.faults.trigger import Lasting, Repeat, When
from glotouch_bt.mission.load import Mission, load_mission, split_settings
from glotouch_bt.mission.runner import run_mission
from glotouch_bt.mission.source import Place
from glotouch_bt.mission.tally import NullRecord
from glotouch_bt.mission.worlds import load_conditions
from glotouch_bt.robot import Backend, load_backend

KINDS = ("robot_fault", "exception")
MOST_CALLS = 100_000


@dataclass(frozen=True)
class Exhaustive:
    """What shall be tried.

    Attributes:
        mission: A short one.
        settings: Its parameters.
        backend: A quick one.
        seed: Of every run.
        stride: Every n-th call only.
        out: Where summary.json goes.
    """

    mission: str
    settings: Mapping[str, str]
    backend: str
    seed: int
    stride: int
    out: Path


def run_exhaustive(study: Exhaustive, on_progress: Callable[[int, str], None] | None = None) -> dict[str, Any]:
    """Fail call after call; every run must end with its reason named and the arm held.

    Returns:
        calls: of the unfaulted run; tried; and the calls after which something was not as it must be.
    """
    mission, backend = load_mission(study.mission, study.settings), load_backend(study.backend)
    bad: list[dict[str, Any]] = []
    tried, calls = 0, 0
    for name in KINDS:
        n = 0
        while n < MOST_CALLS:
            seen = _once(study, mission, backend, name, n)
            if seen is None:
                break
            tried += 1
            if seen:
                bad.append({"fault": name, "call": n, "what": seen})
            if on_progress is not None and tried % 100 == 1:
                on_progress(n, name)
            n += study.stride
        calls = max(calls, n)
    summary = {
        "mission": study.mission,
        "backend": study.backend,
        "calls": calls,
        "tried": tried,
        "stride": study.stride,
    }
    summary |= {"kinds": list(KINDS), "bad": bad}
    study.out.mkdir(parents=True, exist_ok=True)
    (study.out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    return summary


def _once(study: Exhaustive, mission: Mission, backend: Backend, name: str, call: int) -> str | None:
    """Fail one call. None: it never came; empty: all as it must be; else what was not."""
    kind = CATALOGUE[name]
    spec = FaultSpec(
        name, kind, kind.effect.Params(), When(call=call), Lasting(until="ever"), Repeat(), Place("exhaustive")
    )
    options = split_settings(mission, study.settings)
    conditions = load_conditions("ideal")
    injector = FaultInjector(
        backend.open(mission.world, conditions, study.seed, options), FaultPlan(name, (spec,)), study.seed
    )
    problems: list[str] = []
    try:
        with injector:
            outcome = run_mission(mission, injector, ListeningRecord(NullRecord(), injector))
        if injector.proofs()[0].changes == 0:
            return None
        if outcome.status != "aborted":
            problems.append(f"status {outcome.status}")
        if not outcome.reasons or "injected" not in outcome.reasons[-1]:
            problems.append(f"reasons {outcome.reasons}")
        elif not outcome.chain[-1].node:
            problems.append("no node named")
    except Exception as e:
        if call > 0 or "injected" not in str(e):  # what fails before the first tick is raised to the caller
            problems.append(f"raised {type(e).__name__}: {e}")
    if not injector.held:
        problems.append("the arm was not held")
    return "; ".join(problems)
