"""The functions of the public API that are not those of one layer: run, check, open a robot."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from glotouch_bt.faults import FaultPlan
from glotouch_bt.lazy import load_all
from glotouch_bt.mission import check_feasible, load_mission, split_settings
from glotouch_bt.mission.read import Value, load_conditions, load_world
from glotouch_bt.mission.spec import Finding, MissionFaults
from glotouch_bt.robot import BadInput, Robot, World, load_backend
from glotouch_bt.runs import RunRequest, RunResult, launch


def run(
    mission: str | Path,
    *,
    backend: str = "mujoco",
    seed: int = 0,
    objects: str | Path | None = None,
    world: str | Path | None = None,
    conditions: str | Path = "nominal",
    faults: str | Path | FaultPlan | None = None,
    out: str | Path | None = None,
    overwrite: bool = False,
    allow_paths: Sequence[str | Path] = (),
    **settings: object,
) -> RunResult:
    """Run a mission, as `glotouch run` does: same defaults, folder and result.

    Args:
        mission: Path of a mission file, or the name of a shipped mission.
        backend: Name of a registered backend (`glotouch backends`).
        seed: Source of every random draw, 0 .. 2**32 - 1.
        objects: Folder of watertight STL files in metres, instead of the world's.
        world: Path of a world file, or the name of a shipped world, instead of the mission's.
        conditions: Disturbances: ideal, nominal, harsh, realistic, strong, or a file's path; NAME+FIELD=VALUE changes a
            field.
        faults: A fault plan: a path, the name of a shipped plan, or a loaded plan.
        out: The run's folder (default: runs/<time>-<mission>-s<seed>).
        overwrite: Replace the run that `out` holds.
        allow_paths: Folders in which subtrees may be, besides the mission's own.
        **settings: Mission parameters. Others go to the backend as options.

    Returns:
        The result, for a mission that failed or was aborted as well.

    Raises:
        BadInput: An argument is wrong or the mission has mistakes (`MissionFaults`); nothing has moved.
        BackendError: The backend did not open.
        KeyboardInterrupt: Ctrl-C; the run's folder is complete.
    """
    done = launch(
        RunRequest(
            str(mission),
            backend,
            seed,
            {name: _as_text(value) for name, value in settings.items()},
            None if objects is None else Path(objects),
            str(conditions),
            None if out is None else Path(out),
            faults,
            overwrite=overwrite,
            allow_paths=tuple(map(Path, allow_paths)),
            world=None if world is None else str(world),
        )
    )
    if isinstance(done.outcome.error, KeyboardInterrupt):
        raise done.outcome.error
    return done


def check(
    mission: str | Path,
    settings: Mapping[str, str | Value] | None = None,
    *,
    objects: str | Path | None = None,
    world: str | Path | None = None,
    allow_paths: Sequence[str | Path] = (),
    backend: str = "mujoco",
) -> tuple[Finding, ...]:
    """Check a mission against every outcome of every skill, its objects and the arm's reach, as `glotouch check` does.

    Args:
        mission: Path of a mission file, or the name of a shipped mission.
        settings: Values of the mission's parameters. Others are backend options, such as `robot`.
        objects: Folder of watertight STL files in metres, instead of the world's.
        world: Path of a world file, or the name of a shipped world, instead of the mission's.
        allow_paths: Folders in which subtrees may be, besides the mission's own.
        backend: The robot that must be able to reach the container and to grasp the target.

    Returns:
        Every mistake and warning (`Finding.severity`), with its place; empty for a mission without any.

    Raises:
        BadInput: The mission cannot be read at all.
    """
    try:
        loaded = load_mission(
            mission,
            settings,
            objects=None if objects is None else Path(objects),
            world=None if world is None else str(world),
            allow_paths=tuple(map(Path, allow_paths)),
        )
    except MissionFaults as e:
        return (*e.findings, *e.warnings)
    return (*loaded.warnings, *check_feasible(loaded, backend, split_settings(loaded, settings or {})))


def open_robot(
    backend: str = "mujoco",
    *,
    world: str | Path | World = "container_five",
    conditions: str | Path = "nominal",
    seed: int = 0,
    **options: object,
) -> Robot:
    """Open a robot without a mission. Use it in a `with` block, which holds the arm and closes the robot at the end.

    Args:
        backend: Name of a registered backend (`glotouch backends`).
        world: A world, the path of a world file, or the name of a shipped world.
        conditions: Disturbances: ideal, nominal, harsh, realistic, strong, or a file's path; NAME+FIELD=VALUE changes a
            field.
        seed: Source of every random draw, 0 .. 2**32 - 1.
        **options: Options of the backend.

    Raises:
        BadInput: An argument is wrong.
        BackendError: The backend did not open.
    """
    scene = world if isinstance(world, World) else load_world(str(world))
    found = load_backend(backend)
    load_all()  # a driver stops the arm when the client is silent for as long as an import takes
    return found.open(scene, load_conditions(str(conditions)), seed, options)


def _as_text(value: object) -> str:
    """Return a setting as the command line takes it, so that both record the same run."""
    if isinstance(value, str | Path):
        return str(value)
    try:
        return json.dumps(value)
    except TypeError as e:
        raise BadInput(
            f"setting {value!r}: must be a number, a text, true or false, or plain lists and mappings"
        ) from e
