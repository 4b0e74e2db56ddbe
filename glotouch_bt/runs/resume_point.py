"""Find the checkpoint and the mission from which an interrupted run can be resumed."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile, CheckpointRow, ResumePoint
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import Recorder, read_chunks
from glotouch_bt.robot import BadInput, Conditions, GlotouchError, UnknownName
from glotouch_bt.runs.folder import FILES

EARLIER = "earlier"
"""Subfolder of a run's folder for the files that a resumed run replaces, one numbered folder per resumption."""


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
    request: Mapping[str, Any]
    before: tuple[Mapping[str, Any], ...]
    notes: list[str] = field(default_factory=list)

    def resume_point(self, same_world: bool) -> ResumePoint:
        """Return the resume point for the runner."""
        start = "" if self.world_at_start else self.start
        return ResumePoint(self.row.number, self.file.state(self.row.number), same_world, start)

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
            chunks = list(read_chunks(record, self.row.record_bytes))
            recorder.continue_from(chunks, self.file.state(self.row.number)["record"])
        except BadInput as e:
            self.notes.append(f"the record does not hold what was before the checkpoint: {e}")
        try:
            earlier = self._move_to_earlier()
            if record.is_file():
                _link(record, earlier / "run.mcap")
            part.replace(record)
        except OSError as e:
            raise GlotouchError(f"{self.folder}: its files cannot be moved to '{EARLIER}' ({e.strerror})") from e
        self.file.drop_after(self.row.number)
        self.file.note("resumed", [*self.before, self.as_dict()])
        self.file.note("ended", None)

    def _move_to_earlier(self) -> Path:
        number = 1
        while (self.folder / EARLIER / str(number)).exists():
            number += 1
        earlier = self.folder / EARLIER / str(number)
        earlier.mkdir(parents=True)
        if any(r.number > self.row.number for r in self.file.rows()):
            self.file.copy_to(earlier / CHECKPOINT_FILE)
        for name in FILES:
            if name not in ("run.mcap", CHECKPOINT_FILE, "mission.yaml") and (self.folder / name).is_file():
                (self.folder / name).replace(earlier / name)
        return earlier


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


def find_resumable(folder: Path, start: str | None, versions: Mapping[str, str]) -> ResumableRun:
    """Find the checkpoint to resume a run from.

    Args:
        folder: The run's folder.
        start: Name or path of a node to start at, or None to continue.
        versions: Installed versions.

    Raises:
        BadInput: There is no usable checkpoint, the mission has changed, the run has ended (without `start`), or
            inputs of the start node are missing.
        UnknownName: There is no such node.
    """
    if not folder.is_dir():
        raise BadInput(f"{folder}: no run here")
    file = CheckpointFile(folder / CHECKPOINT_FILE)
    try:
        return _find_resumable(folder, file, start, versions)
    except BaseException:
        file.close()
        raise


def _find_resumable(folder: Path, file: CheckpointFile, start: str | None, versions: Mapping[str, str]) -> ResumableRun:
    run, rows, notes = file.run, file.rows(), list[str]()
    if not rows:
        raise BadInput(f"{folder}: was interrupted before its first checkpoint; run it again")
    ended = run.get("ended")
    if ended in ("success", "failure") and start is None:
        word = "reached its goal" if ended == "success" else "failed, as its result says"
        raise BadInput(
            f"{folder}: this run has ended ({word}); there is nothing to resume. --from NODE starts it again at a node"
        )
    different = [
        f"{k} {run['versions'].get(k, 'none')} (here {v})" for k, v in versions.items() if run["versions"].get(k) != v
    ]
    if different:
        notes.append(f"the run was made with {', '.join(different)}")
    mission = _mission(folder, run)
    conditions = {k: tuple(v) if isinstance(v, list) else v for k, v in run["conditions"].items()}
    if asdict(load_conditions(run["request"]["conditions"])) != conditions:
        raise BadInput(f"{folder}: the conditions {run['request']['conditions']!r} have changed since this run began")
    path = "" if start is None else _node(mission, start)
    row = _row_before(rows, path)
    if path and row is None:
        _require_inputs(mission, path, file.state(rows[-1].number))
    leads = row is not None
    return ResumableRun(
        folder, file, row or rows[-1], mission, path, leads, run["request"], tuple(run["resumed"]), notes
    )


def _mission(folder: Path, run: Mapping[str, Any]) -> Mission:
    """Load the mission of the run: from its own file if unchanged, otherwise from the run's folder."""
    request = run["request"]
    objects = None if request["objects"] is None else Path(request["objects"])
    problems: list[str] = []
    for given in (request["mission"], str(folder / "mission.yaml")):
        try:
            found = load_mission(given, request["settings"], objects=objects)
        except BadInput as e:
            problems.append(str(e))
            continue
        if _plain(found.document) == _plain(run["mission"]):
            return found
        problems.append(f"{given}: has changed since")
    raise BadInput(f"{folder}: its mission cannot be loaded again: {'; '.join(problems)}")


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
        BadInput: The folder is not empty or cannot be written.
    """
    if to.exists() and any(to.iterdir()):
        raise BadInput(f"--out {to}: is not empty")
    file = CheckpointFile(folder / CHECKPOINT_FILE)
    try:
        to.mkdir(parents=True, exist_ok=True)
        file.copy_to(to / CHECKPOINT_FILE)
        for name in ("mission.yaml", "run.mcap"):
            if (folder / name).is_file():
                shutil.copy2(folder / name, to / name)
    except OSError as e:
        raise BadInput(f"--out {to}: cannot be written ({e.strerror})") from e
    finally:
        file.close()


def _link(source: Path, target: Path) -> None:
    """Link a file under another name; copy it where the file system has no links."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
