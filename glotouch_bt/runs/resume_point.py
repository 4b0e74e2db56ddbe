"""Find the checkpoint and the mission from which an interrupted run can be resumed.

The folder may come from a stranger: it is data. It chooses a mission that lies in it or is shipped, a registered
backend, a seed and conditions. Paths, and backend options that are not portable, must be given again.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.mission import Mission, load_mission, split_settings
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile, CheckpointRow, ResumePoint
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.read import conditions_of, shipped
from glotouch_bt.mission.record import MAX_RECORD_BYTES, Recorder, read_chunks
from glotouch_bt.robot import Backend, BadInput, Conditions, GlotouchError, UnknownName
from glotouch_bt.runs.folder import EARLIER, FILES, require_run_folder
from glotouch_bt.untrusted import copy_file, require_type

STORED = {
    "request": dict[str, Any], "mission": dict[str, Any], "conditions": dict[str, Any], "versions": dict[str, str],
    "ended": str | None, "resumed": list[dict[str, Any]],
}  # fmt: skip
REQUESTED = {
    "mission": str, "backend": str, "seed": int, "settings": dict[str, str], "objects": str | None, "conditions": str,
    "faults": str | None,
}  # fmt: skip
"""Types of the description of a run, and of the request in it, as a checkpoint file stores them."""


@dataclass(frozen=True)
class ResumableRun:
    """An interrupted run that can be resumed.

    Attributes:
        folder: The run's folder.
        file: Its checkpoints.
        row: The checkpoint to resume from.
        mission: The mission of the run.
        start: Path of the node to start at, or empty to continue.
        world_at_start: The checkpoint was taken right before `start`, so that continuing reaches it.
        conditions: The conditions of the run.
        request: The run's request: mission, backend, seed, settings, objects, conditions, faults.
        before: Earlier resumptions.
        notes: Notes for the operator, in the result and on the terminal.
    """

    folder: Path
    file: CheckpointFile
    row: CheckpointRow
    mission: Mission
    start: str
    world_at_start: bool
    conditions: Conditions
    request: Mapping[str, Any]
    before: tuple[Mapping[str, Any], ...]
    notes: list[str] = field(default_factory=list)

    def resume_point(self, same_world: bool) -> ResumePoint:
        """Return the resume point for the runner."""
        start = "" if self.world_at_start else self.start
        return ResumePoint(self.row.number, self.file.state(self.row.number), same_world, start)

    def options(self, backend: Backend, given: Mapping[str, object]) -> dict[str, object]:
        """Return the backend options of the resumed run: those given now, and the portable ones of the run.

        Args:
            backend: The backend.
            given: Options given now; an empty value leaves one of the run's out.

        Raises:
            BadInput: The run asks for an option that is not portable and is not given now.
        """
        asked = split_settings(self.mission, self.request["settings"])
        refused = [n for n, value in asked.items() if n not in given and not backend.is_portable(n, value)]
        if refused:
            was = ", ".join(f"{n}={asked[n]!r}" for n in refused)
            again = " ".join(f"--set {n}=..." for n in refused)
            raise BadInput(
                f"{self.folder}: this run was made with {was}, and a run's folder does not choose programs, files, "
                f"addresses and devices: give them again, or leave them empty: glotouch resume {self.folder} {again}"
            )
        return {n: value for n, value in {**asked, **given}.items() if value != ""}

    def as_dict(self) -> dict[str, Any]:
        """Return this resumption as in result.json."""
        return {
            "checkpoint": self.row.number,
            "at_s": round(self.row.stamp_s, 6),
            "after": self.row.node,
            "start": self.start,
            "notes": list(self.notes),
        }

    def begin(self, part: Path, recorder: Recorder, same_world: bool) -> None:
        """Continue the record from the checkpoint, in `part`; move the replaced files to `earlier`.

        Without the same world the clock is a new one, and the record starts again.

        Raises:
            GlotouchError: A file cannot be moved or written.
        """
        record = self.folder / "run.mcap"
        try:
            if not same_world:
                raise BadInput("the robot clock started again (it is in the folder 'earlier')")
            if self.row.record_bytes is None:
                raise BadInput(f"{record}: the checkpoint was taken without a record")
            state: Any = self.file.state(self.row.number).get("record")
            require_type(state, dict[str, int], "the state of the record")
            recorder.continue_from(list(read_chunks(record, self.row.record_bytes)), state)
        except (BadInput, LookupError) as e:
            self.notes.append(f"the record does not hold what was before the checkpoint: {e}")
        try:
            earlier = self._new_earlier()
            if any(r.number > self.row.number for r in self.file.rows()):
                self.file.copy_to(earlier / CHECKPOINT_FILE)
            # From here on the run has not ended, so that a kill between two steps leaves one that can be resumed.
            self.file.begin_again(self.row.number, [*self.before, self.as_dict()])
            if record.is_file():
                _link(record, earlier / "run.mcap")
            part.replace(record)
            for name in FILES:
                if name not in ("run.mcap", CHECKPOINT_FILE, "mission.yaml") and (self.folder / name).is_file():
                    (self.folder / name).replace(earlier / name)
        except OSError as e:
            raise GlotouchError(f"{self.folder}: its files cannot be moved to '{EARLIER}' ({e.strerror})") from e

    def _new_earlier(self) -> Path:
        parent, number = self.folder / EARLIER, 1
        parent.mkdir(exist_ok=True)
        while os.path.lexists(parent / str(number)):
            number += 1
        (parent / str(number)).mkdir()
        return parent / str(number)


def describe_checkpointed_run(
    request: Mapping[str, Any], mission: Mission, conditions: Conditions, versions: Mapping[str, str]
) -> dict[str, Any]:
    """Return the description of a run that its checkpoint file stores, as JSON data."""
    return {
        "request": dict(request),
        "mission": dict(mission.document),
        "conditions": asdict(conditions),
        "versions": dict(versions),
        "ended": None,
        "resumed": [],
    }


def find_resumable(
    folder: Path,
    start: str | None,
    versions: Mapping[str, str],
    settings: Mapping[str, str] | None = None,
    objects: Path | None = None,
) -> ResumableRun:
    """Find the checkpoint to resume a run from.

    Args:
        folder: The run's folder.
        start: Name or path of a node to start at, or None to continue.
        versions: Installed versions.
        settings: Backend options given now.
        objects: Folder of STL files given now.

    Raises:
        BadInput: There is no usable checkpoint, the mission has changed, the run has ended (without `start`), inputs of
            the start node are missing, a path must be given again, or the folder holds links.
        UnknownName: There is no such node.
    """
    if not folder.is_dir():
        raise BadInput(f"{folder}: no run here")
    require_run_folder(folder)
    file = CheckpointFile(folder / CHECKPOINT_FILE)
    try:
        return _find_resumable(folder, file, start, versions, settings or {}, objects)
    except BaseException:
        file.close()
        raise


def _find_resumable(
    folder: Path,
    file: CheckpointFile,
    start: str | None,
    versions: Mapping[str, str],
    settings: Mapping[str, str],
    objects: Path | None,
) -> ResumableRun:
    run, rows, notes = stored_run(file), file.rows(), list[str]()
    request = run["request"]
    if not rows:
        raise BadInput(f"{folder}: was interrupted before its first checkpoint; run it again")
    ended = run["ended"]
    if ended in ("success", "failure") and start is None and (folder / "result.json").exists():
        word = "reached its goal" if ended == "success" else "failed, as its result says"
        raise BadInput(
            f"{folder}: this run has ended ({word}); there is nothing to resume. --from NODE starts it again at a node"
        )
    different = [
        f"{k} {run['versions'].get(k, 'none')} (here {v})" for k, v in versions.items() if run["versions"].get(k) != v
    ]
    if different:
        notes.append(f"the run was made with {', '.join(different)}")
    if request["objects"] is not None and objects is None:
        raise BadInput(
            f"{folder}: this run was made with --objects {request['objects']!r}, and a run's folder names no paths: "
            f"give it again: glotouch resume {folder} --objects DIR"
        )
    mission = mission_of_run(folder, run, objects)
    fixed = [name for name in settings if name in mission.parameters]
    if fixed:
        raise BadInput(f"--set {fixed[0]}: is a parameter of the mission; a resumed run keeps its parameters")
    path = "" if start is None else _node(mission, start)
    row = _row_before(rows, path)
    if path and row is None:
        _require_inputs(mission, path, file.state(rows[-1].number))
    leads, conditions = row is not None, conditions_of(run["conditions"], f"{folder}: conditions")
    chosen, before = row or rows[-1], tuple(run["resumed"])
    file.state(chosen.number), file.world(chosen.number)  # raise before anything is opened
    return ResumableRun(folder, file, chosen, mission, path, leads, conditions, request, before, notes)


def stored_run(file: CheckpointFile) -> dict[str, Any]:
    """Return the description of a run from its checkpoint file.

    Raises:
        BadInput: It is damaged.
    """
    run = file.run
    for given, types, where in ((run, STORED, "its run"), (run.get("request"), REQUESTED, "its request")):
        require_type(given, dict[str, Any], f"{file.path}: {where}")
        assert isinstance(given, dict)
        for name, hint in types.items():
            if name not in given:
                raise BadInput(f"{file.path}: {where} lacks {name!r}: it is damaged or of another version")
            require_type(given[name], hint, f"{file.path}: {where}: {name}")
    return run


def mission_of_run(folder: Path, run: Mapping[str, Any], objects: Path | None) -> Mission:
    """Load the mission of the run from its folder; if that file has changed, a shipped one of that name."""
    request = run["request"]
    problems: list[str] = []
    shipped_name = [request["mission"]] if request["mission"] in shipped("") else []
    for given in (str(folder / "mission.yaml"), *shipped_name):
        try:
            found = load_mission(given, request["settings"], objects=objects)
        except BadInput as e:
            problems.append(str(e))
            continue
        if _plain(found.document) == _plain(run["mission"]):
            return found
        problems.append(f"{given}: has changed since")
    raise BadInput(f"{folder}: its mission cannot be loaded again: {'; '.join(dict.fromkeys(problems))}")


def _plain(document: Mapping[str, Any]) -> Any:
    return yaml.safe_load(yaml.safe_dump(dict(document)))


def _node(mission: Mission, given: str) -> str:
    """Return the path of a node given by its path, the end of its path, or its name."""
    paths = mission.spec.paths(mission.name)
    if given in paths:
        return given
    matching = [p for p in paths if p.endswith(f"/{given}")]
    if len(matching) == 1:
        return matching[0]
    if matching:
        raise BadInput(f"--from {given}: could be {' or '.join(matching)}")
    raise UnknownName("node", given, [p.rsplit("/", 1)[-1] for p in paths])


def _row_before(rows: list[CheckpointRow], path: str) -> CheckpointRow | None:
    """Return the last checkpoint with a simulated world after which the node started, or None.

    A real world cannot be restored: there a node starts from the newest checkpoint.
    """
    if path:
        for before, after in zip(reversed(rows[:-1]), reversed(rows[1:]), strict=True):
            if path in after.begun and before.has_world:
                return before
    return None


def _require_inputs(mission: Mission, path: str, state: Mapping[str, Any]) -> None:
    """Require the checkpoint to hold every input that the node and its children read before writing it."""
    have = {name.removeprefix("port ") for name in state if name.startswith("port ")}
    missing: list[str] = []
    paths = mission.spec.paths(mission.name)
    inside = paths[path]
    around = [spec for above, spec in paths.items() if path.startswith(f"{above}/")]
    for spec in (*around, *inside.walk()):
        needed = kind_of(spec).required_keys(spec)
        missing += [f"{key!r} (read by {spec.name!r})" for key in needed if key not in have]
        have |= {wire.key for wire in spec.writes.values()}
    if missing:
        raise BadInput(f"--from {inside.name}: the checkpoint has no {', '.join(dict.fromkeys(missing))}")


def copy_run(folder: Path, to: Path) -> None:
    """Copy the files of a run that a resumption needs to another folder.

    Raises:
        BadInput: The folder is not empty or cannot be written, or that of the run holds links.
    """
    require_run_folder(folder)
    file = CheckpointFile(folder / CHECKPOINT_FILE)
    try:
        if to.exists() and any(to.iterdir()):
            raise BadInput(f"--out {to}: is not empty")
        to.mkdir(parents=True, exist_ok=True)
        file.copy_to(to / CHECKPOINT_FILE)
        for name in ("mission.yaml", "run.mcap"):
            if (folder / name).is_file():
                copy_file(folder / name, to / name, MAX_RECORD_BYTES)
    except OSError as e:
        raise BadInput(f"--out {to}: cannot be written ({e.strerror})") from e
    finally:
        file.close()


def _link(source: Path, target: Path) -> None:
    """Link a file under another name; copy it where the file system has no links."""
    try:
        os.link(source, target, follow_symlinks=False)
    except (OSError, NotImplementedError):
        copy_file(source, target, MAX_RECORD_BYTES)
