"""Missions and fault plans: generated, perhaps corrupted, checked, and run with scripted leaves if they pass."""

from __future__ import annotations

import os
import tempfile
import traceback
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from glotouch_bt.faults import FaultInjector, FaultPlan, read_plan
from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.read import shipped_root
from glotouch_bt.mission_testing import RunsAway, ScriptMaker, ok, run_scripted
from glotouch_bt.robot import BackendError, BadInput, FakeRobot
from glotouch_bt.validation.fuzz.corrupt import as_text, corrupt_bytes, corrupt_data, levels_of
from glotouch_bt.validation.fuzz.documents import PASSIVE, grow_mission, grow_plan
from glotouch_bt.validation.fuzz.kind import Class, FuzzKind, refused

Sort = Literal["mission", "fault plan"]
MAX_TICKS = 300
PLAN_SHARE = 0.25
MAX_DUMPED_LEVELS = 110
"""Deepest nesting that is written as YAML; beyond it the text is nothing but opened brackets."""


class MissionKind(FuzzKind):
    """Missions, and fault plans of a plain mission."""

    name = "missions"
    description = "missions and fault plans, checked and run with scripted leaves"

    def prepare(self, folder: Path) -> None:
        """Add the shipped subtrees and some non-files."""
        (folder / "subtrees").symlink_to(shipped_root() / "subtrees")
        (folder / "self.yaml").write_text("subtree: self\ntree: {subtree: {file: self.yaml}}\n")
        os.mkfifo(folder / "pipe")
        _faulted_mission()  # written before watching starts

    def make(self, rng: np.random.Generator, folder: Path) -> str:
        """See `FuzzKind`."""
        sort, text = document_of(rng)
        (folder / "m.yaml").write_bytes(text)
        return sort

    def attempt(self, sort: str, folder: Path, rng: np.random.Generator) -> tuple[Class, str]:
        """See `FuzzKind`."""
        path = folder / "m.yaml"
        return _mission(path, rng) if sort == "mission" else _plan(path, rng)


def document_of(rng: np.random.Generator) -> tuple[Sort, bytes]:
    """Draw a document; return its sort and its bytes."""
    sort: Sort = "fault plan" if rng.random() < PLAN_SHARE else "mission"
    document = grow_plan(rng) if sort == "fault plan" else grow_mission(rng)
    how = rng.random()
    if 0.25 <= how < 0.65 or how > 0.9:
        document = corrupt_data(document, rng)
    # PyYAML dumps recursively; whether it can must not depend on who calls, or a trial would not be repeatable.
    text = as_text(document, rng) if levels_of(document) <= MAX_DUMPED_LEVELS else b"[" * 5000
    return sort, corrupt_bytes(text, rng) if how >= 0.65 else text


def _mission(path: Path, rng: np.random.Generator) -> tuple[Class, str]:
    settings: dict[str, str] = {"n": str(rng.integers(-5, 30))} if rng.random() < 0.1 else {}
    try:
        mission = load_mission(path, settings)
    except BadInput as e:
        return refused(e)
    mission.resolved_yaml()
    return _run(mission, rng)


def _run(mission: Mission, rng: np.random.Generator) -> tuple[Class, str]:
    run = run_scripted(mission, ScriptMaker(mission).rows(rng), max_ticks=MAX_TICKS)
    repr(run)
    if isinstance(run.error, RunsAway):
        return "ran on", ""
    if run.status == "aborted":
        words = "".join(traceback.format_exception(run.error)) if run.error else "aborted without an error"
        return "accepted wrongly", f"{run!r}\n{words}"
    return ("ran to success", "") if run.succeeded else ("ran to failure", "")


PLAIN_MISSION = "mission: m\nworld: container_five\ntree: [tool_pickup, tool_calibrate, guarded_sweep, tool_return]\n"


@lru_cache(maxsize=1)
def _faulted_mission() -> Mission:
    """Return the mission that fault plans run on."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.yaml"
        path.write_text(PLAIN_MISSION)
        return load_mission(path)


def _plan(path: Path, rng: np.random.Generator) -> tuple[Class, str]:
    mission = _faulted_mission()
    try:
        plan = read_plan(path, mission.spec, mission.name)
    except BadInput as e:
        return refused(e)
    if any(f.kind.channel in PASSIVE for f in plan.faults):
        return "checked only", ""
    return _run_faulted(plan, mission, rng)


def _run_faulted(plan: FaultPlan, mission: Mission, rng: np.random.Generator) -> tuple[Class, str]:
    try:
        robot = FaultInjector(FakeRobot(), plan, int(rng.integers(2**31)))
    except BadInput as e:  # a world fault on a robot without a simulated world
        return refused(e)
    script = {"*": ok().after(float(rng.uniform(0.0, 0.7)))}
    try:
        run = run_scripted(mission, script, robot=robot, max_ticks=MAX_TICKS)
    except BackendError:  # before the first tick the error reaches the caller
        return "stopped by a fault", ""
    robot.report()
    if isinstance(run.error, RunsAway):
        return "ran on", ""
    if run.error is None:
        return ("ran to success", "") if run.succeeded else ("ran to failure", "")
    if isinstance(run.error, BackendError):
        return "stopped by a fault", ""
    return "accepted wrongly", f"{run!r}\n{''.join(traceback.format_exception(run.error))}"
