"""One mission on one backend, from the command line's words to a run's folder with its result.

Only here, and in the report, is the truth of a simulated world looked at, after the run, for scoring.
"""

from __future__ import annotations

import dataclasses
import os
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from glotouch_bt import __version__
from glotouch_bt.faults import FaultInjector, FaultPlan, read_plan
from glotouch_bt.faults.listening import ListeningRecord, injector_in
from glotouch_bt.faults.models import wrong_models
from glotouch_bt.mission.checkpoint import FILE as CHECKPOINTS
from glotouch_bt.mission.checkpoint import CheckpointFile
from glotouch_bt.mission.control import Control
from glotouch_bt.mission.keeping import Keeper, TakenUp
from glotouch_bt.mission.library import shown
from glotouch_bt.mission.load import Mission, load_mission, split_settings
from glotouch_bt.mission.mcap_json import to_json
from glotouch_bt.mission.record import Recorder
from glotouch_bt.mission.runner import Outcome, run_mission
from glotouch_bt.mission.tally import Record, Tally
from glotouch_bt.mission.watchdog import Stuck
from glotouch_bt.mission.worlds import load_conditions
from glotouch_bt.robot import Backend, BadInput, Conditions, Robot, load_backend
from glotouch_bt.robot.referee import Referee, TrueObject
from glotouch_bt.study.going_on import GoingOn, describe_run
from glotouch_bt.study.run_folder import RunFolder

RECORDED_PACKAGES = ("mujoco", "numpy", "pin", "py_trees", "ruckig", "scipy", "trimesh")
LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class RunRequest:
    """What shall be run.

    Attributes:
        mission: Path or shipped name.
        backend: Name of a registered backend.
        seed: Source of every random draw, 0 .. 2**32 - 1.
        settings: `--set` values: mission parameters, and what no parameter takes goes to the backend.
        objects: Folder of STL files instead of the world's.
        conditions: Path or shipped name.
        out: The run's folder (default: runs/<time>-<mission>-s<seed>).
        faults: A fault plan: a path, the name of a shipped one, or one that has been read.
        may_kill: A fault may kill this process: it does nothing but this run.
        report: Make report.html.
    """

    mission: str
    backend: str = "mujoco"
    seed: int = 0
    settings: Mapping[str, str] = field(default_factory=dict)
    objects: Path | None = None
    conditions: str = "nominal"
    out: Path | None = None
    faults: str | Path | FaultPlan | None = None
    may_kill: bool = False
    report: bool = True

    def as_json(self) -> dict[str, Any]:
        """What is needed to open the same robot and mission again."""
        plan = self.faults.name if isinstance(self.faults, FaultPlan) else self.faults
        return {
            "mission": _absolute(self.mission),
            "backend": self.backend,
            "seed": self.seed,
            "settings": dict(self.settings),
            "objects": None if self.objects is None else str(self.objects.resolve()),
            "conditions": _absolute(self.conditions),
            "faults": None if plan is None else str(plan),
        }


@dataclass(frozen=True)
class RunResult:
    """What came of it.

    Attributes:
        folder: The run's folder.
        result: The content of result.json.
        outcome: How it ended.
        report: Path of report.html, or None if none could be made.
        warning: What went wrong after the run (a report that could not be made), or empty.
    """

    folder: Path
    result: Mapping[str, Any]
    outcome: Outcome
    report: Path | None
    warning: str = ""

    @property
    def exit_code(self) -> int:
        """0 done, 1 the mission failed, 3 a safety stop or failure, 130 interrupted."""
        if isinstance(self.outcome.error, KeyboardInterrupt):
            return 130
        return {"success": 0, "failure": 1, "aborted": 3}[self.outcome.status]


def launch(
    request: RunRequest,
    *,
    on_start: Callable[[Mission, Path], None] | None = None,
    on_progress: Callable[[float, Tally], None] | None = None,
    control: Control | None = None,
    going_on: GoingOn | None = None,
) -> RunResult:
    """Check everything, open the backend, run the mission, score it, write the run's folder.

    Args:
        request: What to run.
        on_start: Called with the mission and its folder once the backend is open.
        on_progress: As in `run_mission`.
        control: Who may pause and stop it.
        going_on: A broken-off run to go on with, in its own folder (`study.resume`).

    Raises:
        BadInput: Something given is wrong; nothing moved and nothing is left on disk.
        BackendError: The backend did not open; nothing is left on disk.
    """
    began = time.perf_counter()
    if not 0 <= request.seed <= LARGEST_SEED:
        raise BadInput(f"--seed {request.seed}: must be in 0 .. {LARGEST_SEED}")
    if going_on is not None:
        mission = going_on.mission
    else:
        mission = load_mission(request.mission, request.settings, objects=request.objects)
    conditions = load_conditions(request.conditions)
    plan = _fault_plan(request, mission)
    backend = load_backend(request.backend)
    options = split_settings(mission, request.settings)
    folder = RunFolder(request.out) if request.out else RunFolder.named(mission.name, request.seed)
    try:
        if plan is not None and going_on is None and (models := wrong_models(plan, mission, folder.path / "models")):
            mission = load_mission(request.mission, {**request.settings, **models}, objects=request.objects)
        try:
            robot = backend.open(mission.world, conditions, request.seed, options)
        except BadInput as e:
            if not options:
                raise
            known = ", ".join(mission.parameters) or "none"
            raise BadInput(f"{e} (parameters of mission {mission.name!r}: {known})") from e
        referee = backend.referee(robot)
        world = None if going_on is None else going_on.file.world(going_on.row.number)
        objects_at_start = referee.objects() if referee else []
        if world is not None:
            robot.restore(world)
        if plan is not None:
            robot = _faulted(robot, plan, request, backend)
    except BaseException:
        folder.abandon()
        raise
    with robot:
        if going_on is None:
            folder.clear()
        if on_start is not None:
            on_start(mission, folder.path)
        taken_up = None if going_on is None else going_on.taken_up(same_world=world is not None)
        run = _Run(request, mission, conditions, robot, referee, folder, objects_at_start, began, going_on, taken_up)
        return _run(run, on_progress, control)


def _absolute(given: str) -> str:
    """A file by its whole path, so that it is found from anywhere; a shipped name as it is."""
    return str(Path(given).resolve()) if Path(given).suffix in (".yaml", ".yml") and Path(given).is_file() else given


def _fault_plan(request: RunRequest, mission: Mission) -> FaultPlan | None:
    if request.faults is None or isinstance(request.faults, FaultPlan):
        return request.faults
    return read_plan(request.faults, mission.tree, mission.name)


def _faulted(robot: Robot, plan: FaultPlan, request: RunRequest, backend: Backend) -> Robot:
    """The device with its faults; closed again if they cannot be had."""
    try:
        disturber = backend.disturber(robot)
        return FaultInjector(robot, plan, request.seed, disturber=disturber, may_kill=request.may_kill)
    except BaseException:
        robot.close()
        raise


@dataclass(frozen=True)
class _Run:
    """A run that is about to begin, or to go on."""

    request: RunRequest
    mission: Mission
    conditions: Conditions
    robot: Robot
    referee: Referee | None
    folder: RunFolder
    objects_at_start: list[TrueObject]
    began: float
    going_on: GoingOn | None
    taken_up: TakenUp | None


def _record(run: _Run) -> tuple[Recorder, CheckpointFile, Keeper]:
    """The record and the checkpoints: new ones, or those of the run that goes on."""
    description = _description(run.request, run.mission, run.conditions, run.robot)
    going_on, folder = run.going_on, run.folder
    if going_on is None:
        recorder = Recorder(folder.path / "run.mcap", description)
        asked = run.request.as_json()
        told = describe_run(asked, run.mission, run.conditions, installed_versions())
        file = CheckpointFile.create(folder.path / CHECKPOINTS, told)
        return recorder, file, Keeper(file, recorder)
    part = folder.path / ".run.mcap.part"
    recorder = Recorder(part, description)
    going_on.begin(part, recorder)
    return recorder, going_on.file, Keeper(going_on.file, recorder, going_on.row.number + 1)


def _run(run: _Run, on_progress: Callable[[float, Tally], None] | None, control: Control | None) -> RunResult:
    request, mission, robot, referee, folder = run.request, run.mission, run.robot, run.referee, run.folder
    if run.going_on is None:
        folder.write_text("mission.yaml", _mission_yaml(request, mission))
    ready = time.perf_counter()
    recorder, checkpoints, keeper = _record(run)
    injector = injector_in(robot)
    record: Record = recorder if injector is None else ListeningRecord(recorder, injector)
    result: dict[str, Any] | None = None

    def lost(stuck: Stuck, outcome: Outcome) -> None:
        """The main thread is lost in a skill: write what is known, and end. It writes nothing itself any more."""
        record.event("stuck", outcome.end_s, {"node": stuck.node, "stack": stuck.stack})
        told = _result(request, mission, outcome, None) | {"wall_time_s": round(time.perf_counter() - ready, 3)}
        recorder.close(told)
        folder.write_json("result.json", told)
        sys.stderr.write(f"glotouch: {outcome.reasons[-1]}\n{stuck.stack}")
        sys.stderr.flush()
        os._exit(3)

    try:
        try:
            outcome = run_mission(
                mission,
                robot,
                record,
                on_progress=on_progress,
                control=control,
                on_lost=lost,
                keeper=keeper,
                taken_up=run.taken_up,
            )
        except BaseException:  # it raises only before the first tick
            recorder.close()
            if run.going_on is None:
                folder.clear()
                folder.abandon()
            raise
        ended = time.perf_counter()
        result = _result(request, mission, outcome, referee)
        result |= {"wall_time_s": round(ended - ready, 3), "wall_open_s": round(ready - run.began, 3)}
        if run.going_on is not None:
            result["resumed"] = [*run.going_on.before, run.going_on.told()]
        if injector is not None:
            root = outcome.chain[-1].as_dict() if outcome.chain else {"code": "", "message": ""}
            injector.conclude(outcome.status, str(root["code"]), str(root["message"]), outcome.end_s)
            result |= {"faults": injector.report(), "held_at_end": injector.held}
        checkpoints.note("ended", outcome.status)
    finally:
        recorder.close(result)
        checkpoints.close()
    folder.write_json("result.json", result)
    if referee is not None:
        truth = {"start": _truth(run.objects_at_start), "end": _truth(referee.objects())}
        truth["tip_B_m"] = referee.tip_B_m().tolist()
        folder.write_json("truth.json", truth)
    report, warning = _report(folder.path) if request.report else (None, "")
    return RunResult(folder.path, result, outcome, report, warning)


def _report(folder: Path) -> tuple[Path | None, str]:
    """A run whose report fails is still a run."""
    from glotouch_bt.report import write_report

    try:
        return write_report(folder), ""
    except Exception as e:
        return None, f"the report could not be made ({type(e).__name__}: {e}); `glotouch report {folder}` tries again"


def _mission_yaml(request: RunRequest, mission: Mission) -> str:
    head = f"# backend {request.backend}, seed {request.seed}, conditions {request.conditions}\n"
    return head + mission.resolved_yaml()


def _description(request: RunRequest, mission: Mission, conditions: Conditions, robot: Robot) -> dict[str, object]:
    """What is known before the run; goes into the record. With `robot` a replay needs no backend."""
    world = mission.world
    objects = dataclasses.replace(world.objects, folder=Path(shown(world.objects.folder)))
    return {
        "mission": mission.name,
        "backend": request.backend,
        "seed": request.seed,
        "conditions": conditions,
        "parameters": dict(mission.parameters),
        "pose_B_K": world.container.pose_B_K,
        "container": world.container,
        "probe": world.probe,
        "holder": world.holder,
        "objects": objects,
        "robot": {"description": robot.description, "limits": robot.limits, "period_s": robot.period_s},
        "versions": installed_versions(),
    }


def _result(request: RunRequest, mission: Mission, outcome: Outcome, referee: Referee | None) -> dict[str, Any]:
    found = outcome.found
    target = _target(mission)
    retrieved: str | None = None
    correct: bool | None = None
    peak = found.peak_force_N
    if referee is not None:
        held = [o.name for o in referee.objects() if o.in_gripper]
        retrieved = held[0] if held else None
        correct = retrieved == target if target is not None else None
        peak = referee.peak_force_N()
    return {
        "mission": mission.name,
        "backend": request.backend,
        "seed": request.seed,
        "conditions": Path(request.conditions).stem,
        "status": outcome.status,
        "reasons": outcome.reasons,
        "reason_chain": [to_json(f.as_dict()) for f in outcome.chain],
        "target": target,
        "retrieved": retrieved,
        "correct": correct,
        "ranking": found.ranking,
        "candidates": found.candidates,
        "contacts": found.contacts,
        "sim_time_s": round(outcome.end_s - outcome.start_s, 6),
        "paused_s": round(outcome.paused_s, 6),
        "guards": dict(outcome.guards),
        "ending": outcome.ending,
        "ticks": outcome.ticks,
        "probe_path_m": round(found.probe_path_m, 6),
        "peak_force_N": round(float(peak), 6),
        "sensed_peak_force_N": round(found.peak_force_N, 6),
        "parameters": {k: _portable(k, v, mission) for k, v in mission.parameters.items()},
        "versions": installed_versions(),
    }


def _target(mission: Mission) -> str | None:
    """The object the mission is after: its first stl parameter, by stem."""
    for name in mission.stl_parameters:
        if name in mission.parameters:
            return _stem(str(mission.parameters[name]))
    return None


def _stem(given: str) -> str:
    return Path(given).stem if given.lower().endswith(".stl") else given


def _portable(name: str, value: object, mission: Mission) -> object:
    """A parameter as result.json has it: no path of this machine."""
    return _stem(str(value)) if name in mission.stl_parameters else value


def _truth(objects: list[TrueObject]) -> list[Any]:
    return [to_json(o) for o in objects]


def installed_versions() -> dict[str, str]:
    """Of this package and of those whose version may change a result."""
    found = {"glotouch-bt": __version__}
    for package in RECORDED_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
