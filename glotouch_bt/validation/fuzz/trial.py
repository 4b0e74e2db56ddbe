"""One trial: generate a document, perhaps corrupt it, read and check it, and run it with scripted leaves."""

from __future__ import annotations

import os
import shutil
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from glotouch_bt.faults import FaultInjector, FaultPlan, read_plan
from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.read import shipped_root
from glotouch_bt.mission.spec import MissionFaults
from glotouch_bt.mission_testing import RunsAway, ScriptMaker, ok, run_scripted
from glotouch_bt.robot import BackendError, BadInput, FakeRobot
from glotouch_bt.validation.fuzz.corrupt import as_text, corrupt_bytes, corrupt_data
from glotouch_bt.validation.fuzz.documents import PASSIVE, grow_mission, grow_plan
from glotouch_bt.validation.fuzz.watch import TooLong, Watch

Kind = Literal["mission", "fault plan"]
Class = Literal[
    "refused with places", "refused unread", "ran to success", "ran to failure", "ran on", "stopped by a fault",
    "checked only", "traceback", "hang", "code run", "accepted wrongly",
]  # fmt: skip
BAD: tuple[Class, ...] = ("traceback", "hang", "code run", "accepted wrongly")
MAX_DURATION_S, MAX_TICKS = 30.0, 300
PLAN_SHARE = 0.25


@dataclass(frozen=True)
class Result:
    """Result of one trial.

    Attributes:
        number: Number of the trial.
        kind: Kind of document.
        came: Class of the result.
        detail: Error, traceback or forbidden action, for the bad classes.
        text: The document, for the bad classes.
    """

    number: int
    kind: Kind
    came: Class
    detail: str = ""
    text: bytes = b""


def run_trials(seed: int, numbers: Sequence[int]) -> list[Result]:
    """Run some trials in turn in this process."""
    with _folder() as folder:
        return [run_trial(seed, n, folder) for n in numbers]


@contextmanager
def _folder() -> Iterator[Path]:
    """Make a folder to read documents in, with the shipped subtrees and some non-files."""
    folder = Path(tempfile.mkdtemp(prefix="glotouch-fuzz-"))
    here = Path.cwd()
    try:
        (folder / "subtrees").symlink_to(shipped_root() / "subtrees")
        (folder / "self.yaml").write_text("subtree: self\ntree: {subtree: {file: self.yaml}}\n")
        os.mkfifo(folder / "pipe")
        _faulted_mission()  # written before watching starts
        os.chdir(folder)
        yield folder
    finally:
        os.chdir(here)
        shutil.rmtree(folder, ignore_errors=True)


@lru_cache(maxsize=1)
def _watch() -> Watch:
    return Watch()


def document_of(seed: int, number: int) -> tuple[Kind, bytes, np.random.Generator]:
    """Return kind and bytes of a trial's document, and its random stream."""
    rng = np.random.default_rng([seed, number])
    kind: Kind = "fault plan" if rng.random() < PLAN_SHARE else "mission"
    document = grow_plan(rng) if kind == "fault plan" else grow_mission(rng)
    how = rng.random()
    if 0.25 <= how < 0.65 or how > 0.9:
        document = corrupt_data(document, rng)
    try:
        text = as_text(document, rng)
    except RecursionError:  # PyYAML dumps recursively
        text = b"[" * 5000
    return kind, corrupt_bytes(text, rng) if how >= 0.65 else text, rng


def run_trial(seed: int, number: int, folder: Path) -> Result:
    """Run one trial; nothing in the document makes it raise."""
    kind, text, rng = document_of(seed, number)
    path = folder / "m.yaml"
    path.write_bytes(text)
    watch = _watch()
    try:
        with watch.on(folder, MAX_DURATION_S):
            came, detail = _mission(path, rng) if kind == "mission" else _plan(path, rng)
    except TooLong:
        came, detail = "hang", f"not done after {MAX_DURATION_S:g} s\n{traceback.format_exc()}"
    except (Exception, SystemExit, KeyboardInterrupt, MemoryError):
        came, detail = "traceback", traceback.format_exc()
    if watch.seen:
        came, detail = "code run", "\n".join(watch.seen)
    return Result(number, kind, came, detail, text) if came in BAD else Result(number, kind, came)


def _refused(error: BadInput) -> tuple[Class, str]:
    """Check that a refusal is readable and that every finding has a place."""
    words = str(error)
    if not words.strip() or "Traceback" in words:
        return "traceback", f"unreadable message: {words!r}"
    if not isinstance(error, MissionFaults):
        return "refused unread", ""
    if not error.findings or any(not f.what.strip() or not f.place.file for f in error.findings):
        return "traceback", f"findings without place or text: {error.findings!r}"
    return "refused with places", ""


def _mission(path: Path, rng: np.random.Generator) -> tuple[Class, str]:
    settings: dict[str, str] = {"n": str(rng.integers(-5, 30))} if rng.random() < 0.1 else {}
    try:
        mission = load_mission(path, settings)
    except BadInput as e:
        return _refused(e)
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
        return _refused(e)
    if any(f.kind.channel in PASSIVE for f in plan.faults):
        return "checked only", ""
    return _run_faulted(plan, mission, rng)


def _run_faulted(plan: FaultPlan, mission: Mission, rng: np.random.Generator) -> tuple[Class, str]:
    try:
        robot = FaultInjector(FakeRobot(), plan, int(rng.integers(2**31)))
    except BadInput as e:  # a world fault on a robot without a simulated world
        return _refused(e)
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
