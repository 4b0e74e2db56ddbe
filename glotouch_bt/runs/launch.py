"""Launch a run: check the request, open the backend, run the mission, and write the run's folder.

The truth of a simulated world is read only here, in the report and in views: for scoring, and for a person to look at.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from glotouch_bt.lazy import load_all, settle_garbage
from glotouch_bt.mission import Mission, load_mission, missing_parts, split_settings
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile, CheckpointWriter, ResumePoint
from glotouch_bt.mission.execution import Control, Outcome, SkillHung, deferred_interrupt, run_mission
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import Record, Recorder, RunSummary
from glotouch_bt.motion import out_of_reach
from glotouch_bt.robot import (
    BackendError,
    BadInput,
    Conditions,
    GlotouchError,
    Robot,
    RobotDescription,
    UnknownName,
    load_backend,
)
from glotouch_bt.robot.simulation import Referee, TrueObject
from glotouch_bt.runs.folder import MODELS, RunFolder, locked
from glotouch_bt.runs.lift_witness import LiftWitness
from glotouch_bt.runs.request import RunRequest, RunResult
from glotouch_bt.runs.result import description, final_truth, installed_versions, mission_yaml, score, truth
from glotouch_bt.runs.resume_point import ResumableRun, describe_checkpointed_run
from glotouch_bt.runs.robot_identity import require_same_robot, robot_identity

if TYPE_CHECKING:
    from glotouch_bt.faults import FaultInjector, FaultPlan

MAX_SEED = 2**32 - 1
RECORD_PART = ".run.mcap.part"
"""Name of a resumed run's record until its checkpoint is restored."""


def launch(
    request: RunRequest,
    *,
    on_start: Callable[[Mission, Path], None] | None = None,
    on_truth: Callable[[list[TrueObject]], None] | None = None,
    on_progress: Callable[[float, RunSummary], None] | None = None,
    control: Control | None = None,
    resumable: ResumableRun | None = None,
) -> RunResult:
    """Check the request, open the backend, run the mission, score it, and write the run's folder.

    Args:
        request: The requested run.
        on_start: Called with the mission and its folder once the backend is open.
        on_truth: Called after `on_start` with the true objects of a simulated world, for a person to look at.
        on_progress: As in `run_mission`.
        control: Source of pause and stop requests.
        resumable: An interrupted run to resume, in its own folder (`resume`).

    Raises:
        BadInput: The request is wrong; nothing moved and nothing is left on disk.
        BackendError: The backend did not open, and nothing is left on disk; or the run has ended and an axis of the
            conditions altered nothing, although its sensor was used.
    """
    began = time.perf_counter()
    if not 0 <= request.seed <= MAX_SEED:
        raise BadInput(f"--seed {request.seed}: must be in 0 .. {MAX_SEED}")
    mission = _mission(request) if resumable is None else resumable.mission
    conditions = load_conditions(request.conditions) if resumable is None else resumable.conditions
    plan = _fault_plan(request, mission)
    backend = load_backend(request.backend)
    if not backend.clock_waits:
        load_all()
    options = split_settings(mission, request.settings)
    if resumable is not None:
        options = resumable.options(backend, options)
    folder = RunFolder(request.out) if request.out else RunFolder.timestamped(mission.name, request.seed)
    with locked(folder.path):
        try:
            if resumable is None:
                folder.check_free(request.overwrite)
            if plan is not None and resumable is None:
                mission = _with_wrong_models(mission, plan, request, folder.path / MODELS)
            known = backend.describe(options)
            if known is not None:  # before a real arm is enabled
                _require_suited(known, mission)
            try:
                robot = backend.open(mission.world, conditions, request.seed, options)
            except UnknownName as e:
                if e.name not in options:
                    raise
                names = ", ".join(mission.parameters) or "none"
                what = f"--set {e.name}: mission {mission.name!r} has no such parameter (valid: {names})"
                raise BadInput(f"{what}; {e}") from e
            try:
                referee = backend.referee(robot)
                world = None if resumable is None else resumable.file.world(resumable.row.number)
                objects_at_start = referee.objects() if referee else []
                if resumable is not None:
                    require_same_robot(folder.path, resumable.file.run, robot.description)
                if known is None:
                    _require_suited(robot.description, mission)
                if world is not None:
                    robot.restore(world)
                if plan is not None:
                    from glotouch_bt.faults import FaultInjector

                    disturber = backend.disturber(robot)
                    robot = FaultInjector(robot, plan, request.seed, disturber=disturber, may_kill=request.may_kill)
            except BaseException:
                robot.close()
                raise
        except BaseException:
            folder.discard()
            raise
        with robot:
            if backend.clock_waits:
                settle_garbage()
            if resumable is None:
                folder.clear()
            if on_start is not None:
                on_start(mission, folder.path)
            if on_truth is not None:
                on_truth(objects_at_start)
            resume_point = None if resumable is None else resumable.resume_point(same_world=world is not None)
            run = _Run(
                request, mission, conditions, robot, referee, folder, objects_at_start, began, resumable, resume_point
            )
            return _run(run, on_progress, control)


def _require_suited(description: RobotDescription, mission: Mission) -> None:
    if missing := missing_parts(mission, description):
        listed = "\n".join(f"{place}: {fault}" for place, fault in missing)
        raise BadInput(f"{listed}\nset it to false, or use a robot that has it")
    if faults := out_of_reach(description, mission.world):
        listed = "\n".join(f"{description.name} cannot reach {fault}" for fault in faults)
        raise BadInput(f"{listed}\nmove it in the world file, or use an arm that reaches farther")


def _mission(request: RunRequest, **more: str) -> Mission:
    settings = {**request.settings, **more}
    return load_mission(
        request.mission, settings, objects=request.objects, world=request.world, allow_paths=request.allow_paths
    )


def _fault_plan(request: RunRequest, mission: Mission) -> FaultPlan | None:
    if request.faults is None:
        return None
    from glotouch_bt.faults import FaultPlan, read_plan

    given = request.faults
    return given if isinstance(given, FaultPlan) else read_plan(given, mission.spec, mission.name)


def _with_wrong_models(mission: Mission, plan: FaultPlan, request: RunRequest, folder: Path) -> Mission:
    """Return the mission with the wrong models of a fault plan, if it has any."""
    from glotouch_bt.faults import wrong_models

    models = wrong_models(plan, mission, folder)
    return _mission(request, **models) if models else mission


@dataclass(frozen=True)
class _Run:
    """A run that is about to start or to resume."""

    request: RunRequest
    mission: Mission
    conditions: Conditions
    robot: Robot
    referee: Referee | None
    folder: RunFolder
    objects_at_start: list[TrueObject]
    began: float
    resumable: ResumableRun | None
    resume_point: ResumePoint | None


def _record(run: _Run) -> tuple[Recorder, CheckpointFile, CheckpointWriter]:
    """Open the record and the checkpoints, new ones or those of a resumed run."""
    setup = description(run.request, run.mission, run.conditions, run.robot)
    resumable, folder = run.resumable, run.folder
    if resumable is None:
        recorder = Recorder(folder.path / "run.mcap", setup)
        described = describe_checkpointed_run(run.request.as_json(), run.mission, run.conditions, installed_versions())
        described["robot"] = robot_identity(run.robot.description)
        file = CheckpointFile.create(folder.path / CHECKPOINT_FILE, described)
        return recorder, file, CheckpointWriter(file, recorder)
    recorder = Recorder(folder.path / RECORD_PART, setup)
    return recorder, resumable.file, CheckpointWriter(resumable.file, recorder, resumable.row.number + 1)


def _run(run: _Run, on_progress: Callable[[float, RunSummary], None] | None, control: Control | None) -> RunResult:
    request, mission, robot, referee, folder = run.request, run.mission, run.robot, run.referee, run.folder
    if run.resumable is None:
        folder.write_text("mission.yaml", mission_yaml(request, mission, robot.description.name))
    ready = time.perf_counter()
    recorder, store, checkpoints = _record(run)
    resume_point = run.resume_point
    if run.resumable is not None and resume_point is not None:
        begin = partial(run.resumable.begin, recorder.path, recorder, resume_point.same_world)
        resume_point = replace(resume_point, on_restored=begin)
    lifts = LiftWitness(recorder, referee)
    record: Record = lifts
    injector: FaultInjector | None = None
    if request.faults is not None:
        from glotouch_bt.faults import ListeningRecord, injector_in

        injector = injector_in(robot)
        record = lifts if injector is None else ListeningRecord(lifts, injector)

    def exit_stuck(stuck: SkillHung, outcome: Outcome) -> None:
        """Write what is known and end the process, because the main thread hangs in a skill."""
        try:
            record.event("stuck", outcome.end_s, {"node": stuck.node, "stack": stuck.stack})
            result = score(request, mission, outcome, None, robot) | {
                "wall_time_s": round(time.perf_counter() - ready, 3)
            }
            _write_end(recorder, folder, result)
            sys.stderr.write(f"glotouch: {outcome.reasons[-1]}\n{stuck.stack}")
            sys.stderr.flush()
        finally:
            os._exit(3)

    with closing(store), closing(recorder):
        try:
            outcome = run_mission(
                mission,
                robot,
                record,
                on_progress=on_progress,
                control=control,
                on_unresponsive=exit_stuck,
                checkpoints=checkpoints,
                resume_point=resume_point,
            )
        except BaseException:  # it raises only before the first tick
            recorder.close()
            if run.resumable is None:
                folder.clear()
                folder.discard()
            else:
                (folder.path / RECORD_PART).unlink(missing_ok=True)
            raise
        with deferred_interrupt(raising=False):  # Ctrl-C must not lose the result
            ended = time.perf_counter()
            seen, unscored = final_truth(referee)
            result = score(request, mission, outcome, seen, robot) | ({"unscored": unscored} if unscored else {})
            result |= {} if referee is None else {"lifted": lifts.lifted}
            result |= {"wall_time_s": round(ended - ready, 3), "wall_open_s": round(ready - run.began, 3)}
            if run.resumable is not None:
                result["resumed"] = [*run.resumable.before, run.resumable.as_dict()]
            if injector is not None:
                root = outcome.chain[-1].as_dict() if outcome.chain else {"code": "", "message": ""}
                injector.conclude(outcome.status, str(root["code"]), str(root["message"]), outcome.end_s)
                result |= {"faults": injector.report(), "held_at_end": injector.held}
            unwritten = _write_end(recorder, folder, result)
            if seen is not None:
                ends = {"start": truth(run.objects_at_start), "end": truth(seen.objects)}
                truths = {**ends, "tip_B_m": seen.tip_B_m}
                unwritten += _errors_of(lambda: folder.write_json("truth.json", truths))
            if not unwritten:  # a run killed before this can be resumed
                unwritten = _errors_of(lambda: store.note("ended", outcome.status))
    report, warning = _report(folder.path, mission.world.objects.folder) if request.report else (None, "")
    if seen is not None and seen.silent_axes and outcome.status != "aborted":
        raise BackendError(
            f"conditions {', '.join(seen.silent_axes)} altered nothing in this run ({folder.path}): "
            "choose a larger value, or leave them out"
        )
    return RunResult(folder.path, result, outcome, report, warning, tuple(unwritten))


def _write_end(recorder: Recorder, folder: RunFolder, result: Mapping[str, Any]) -> list[str]:
    """Close the record and write result.json, each on its own; return the errors."""
    return _errors_of(lambda: recorder.close(result)) + _errors_of(lambda: folder.write_json("result.json", result))


def _errors_of(write: Callable[[], None]) -> list[str]:
    try:
        write()
    except GlotouchError as e:
        return [str(e)]
    return []


def _report(folder: Path, objects: Path) -> tuple[Path | None, str]:
    """Return the report's path, or a warning if it could not be made."""
    from glotouch_bt.report import write_report

    try:
        return write_report(folder, objects), ""
    except (Exception, KeyboardInterrupt) as e:
        return None, f"the report could not be made ({type(e).__name__}: {e}); `glotouch report {folder}` tries again"
