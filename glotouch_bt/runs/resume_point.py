"""A broken-off run's folder as something to go on from: which checkpoint, which mission, what was lost."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml

from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.checkpoint import FILE, CheckpointFile, ResumePoint, Row
from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.read import load_conditions
from glotouch_bt.mission.record import Recorder, read_chunks
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.robot import BadInput, Conditions, GlotouchError, UnknownName
from glotouch_bt.runs.folder import FILES

EARLIER = "earlier"
"""Folder in a run's folder that keeps what a resumed run replaces, one numbered folder a resumption."""


@dataclass(frozen=True)
class ResumableRun:
    """What a run goes on from.

    Attributes:
        folder: The run's folder.
        file: Its checkpoints.
        row: The one to go on from.
        mission: As it was.
        start: Path of the node to begin with, or empty: what came next.
        leads: It need not be told to: what came next at the checkpoint is that node.
        request: What the run was asked for: mission, backend, seed, settings, objects, conditions, faults.
        before: What is known of earlier resumptions.
        notes: What a person should know, for the result and the terminal.
    """

    folder: Path
    file: CheckpointFile
    row: Row
    mission: Mission
    start: str
    leads: bool
    request: Mapping[str, Any]
    before: tuple[Mapping[str, Any], ...]
    notes: list[str] = field(default_factory=list)

    def resume_point(self, same_world: bool) -> ResumePoint:
        """For the runner."""
        start = "" if self.leads else self.start
        return ResumePoint(self.row.number, self.file.state(self.row.number), same_world, start)

    def told(self) -> dict[str, Any]:
        """This resumption, as result.json has it."""
        return {
            "checkpoint": self.row.number,
            "at_s": round(self.row.stamp_s, 6),
            "after": self.row.node,
            "start": self.start,
            "notes": list(self.notes),
        }

    def begin(self, part: Path, recorder: Recorder, same_world: bool) -> None:
        """The record goes on from the checkpoint, in `part`; what it replaces moves to `earlier`.

        On another world the clock is another one, too: the record begins anew.

        Raises:
            GlotouchError: The disk refused.
        """
        record = self.folder / "run.mcap"
        try:
            if not same_world:
                raise BadInput("the robot's clock began anew (it is in the folder 'earlier')")
            if self.row.record_bytes is None:
                raise BadInput(f"{record}: the checkpoint knows of no record")
            chunks = list(read_chunks(record, self.row.record_bytes))
            recorder.go_on_from(chunks, self.file.state(self.row.number)["record"])
        except BadInput as e:
            self.notes.append(f"the record does not hold what was before the checkpoint: {e}")
        try:
            kept = self._save()
            if record.is_file():
                _link(record, kept / "run.mcap")
            part.replace(record)
        except OSError as e:
            raise GlotouchError(f"{self.folder}: what is there cannot be moved to '{EARLIER}' ({e.strerror})") from e
        self.file.drop_after(self.row.number)
        self.file.note("resumed", [*self.before, self.told()])
        self.file.note("ended", None)

    def _save(self) -> Path:
        number = 1
        while (self.folder / EARLIER / str(number)).exists():
            number += 1
        kept = self.folder / EARLIER / str(number)
        kept.mkdir(parents=True)
        if any(r.number > self.row.number for r in self.file.rows()):
            self.file.copy_to(kept / FILE)
        for name in FILES:
            if name not in ("run.mcap", FILE, "mission.yaml") and (self.folder / name).is_file():
                (self.folder / name).replace(kept / name)
        return kept


def describe_run(
    request: Mapping[str, Any], mission: Mission, conditions: Conditions, versions: Mapping[str, str]
) -> dict[str, Any]:
    """What a checkpoint file says of its run, as JSON data."""
    return {
        "request": dict(request),
        "mission": dict(mission.document),
        "conditions": asdict(conditions),
        "versions": dict(versions),
        "ended": None,
        "resumed": [],
    }


def find(folder: Path, start: str | None, versions: Mapping[str, str]) -> ResumableRun:
    """Where a run can go on.

    Args:
        folder: A run's folder.
        start: Name or path of a node to start at, whatever came next.
        versions: Of what is installed here.

    Raises:
        BadInput: No checkpoint, of another version, a mission that has changed, a run that has ended (without `start`),
            a node whose inputs are not there.
        UnknownName: No such node.
    """
    if not folder.is_dir():
        raise BadInput(f"{folder}: no run here")
    file = CheckpointFile(folder / FILE)
    try:
        return _find(folder, file, start, versions)
    except BaseException:
        file.close()
        raise


def _find(folder: Path, file: CheckpointFile, start: str | None, versions: Mapping[str, str]) -> ResumableRun:
    run, rows, notes = file.run, file.rows(), list[str]()
    if not rows:
        raise BadInput(f"{folder}: was broken off before its first checkpoint; run it again")
    ended = run.get("ended")
    if ended in ("success", "failure") and start is None:
        word = "reached its goal" if ended == "success" else "failed, as its result says"
        raise BadInput(
            f"{folder}: this run has ended ({word}); there is nothing to resume. --from NODE starts it again at a node"
        )
    odd = [
        f"{k} {run['versions'].get(k, 'none')} (here {v})" for k, v in versions.items() if run["versions"].get(k) != v
    ]
    if odd:
        notes.append(f"the run was made with {', '.join(odd)}")
    mission = _mission(folder, run)
    if asdict(load_conditions(run["request"]["conditions"])) != _as_loaded(run["conditions"]):
        raise BadInput(f"{folder}: the conditions {run['request']['conditions']!r} have changed since this run began")
    path = "" if start is None else _node(mission, start)
    row = _row_before(rows, path)
    if path and row is None:
        _require_inputs(mission, path, file.state(rows[-1].number))
    leads = row is not None
    return ResumableRun(
        folder, file, row or rows[-1], mission, path, leads, run["request"], tuple(run["resumed"]), notes
    )


def _as_loaded(data: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}


def _mission(folder: Path, run: Mapping[str, Any]) -> Mission:
    """The mission as it was: from its own file if that is unchanged, else from the run's folder."""
    request = run["request"]
    objects = None if request["objects"] is None else Path(request["objects"])
    missing: list[str] = []
    for given in (request["mission"], str(folder / "mission.yaml")):
        try:
            found = load_mission(given, request["settings"], objects=objects)
        except BadInput as e:
            missing.append(str(e))
            continue
        if _plain(found.document) == _plain(run["mission"]):
            return found
        missing.append(f"{given}: has changed since")
    raise BadInput(f"{folder}: its mission cannot be had again: {'; '.join(missing)}")


def _plain(document: Mapping[str, Any]) -> Any:
    return yaml.safe_load(yaml.safe_dump(dict(document)))


def _paths(mission: Mission) -> dict[str, NodeSpec]:
    found: dict[str, NodeSpec] = {}

    def look(spec: NodeSpec, above: str) -> None:
        path = f"{above}/{spec.name}"
        found[path] = spec
        for child in spec.children:
            look(child, path)

    look(mission.spec, mission.name)
    return found


def _node(mission: Mission, given: str) -> str:
    """The path of a node given by its path, the end of it, or its name."""
    paths = _paths(mission)
    if given in paths:
        return given
    matching = [p for p in paths if p.endswith(f"/{given}")]
    if len(matching) == 1:
        return matching[0]
    if matching:
        raise BadInput(f"--from {given}: could be {' or '.join(matching)}")
    raise UnknownName("node", given, [p.rsplit("/", 1)[-1] for p in paths])


def _row_before(rows: list[Row], path: str) -> Row | None:
    """The last checkpoint after which the node began, with the world of then; None if there is none, or none is asked.

    A real world does not go back: there, a node starts with the newest checkpoint.
    """
    if path:
        for before, after in zip(reversed(rows[:-1]), reversed(rows[1:]), strict=True):
            if path in after.begun and before.has_world:
                return before
    return None


def _require_inputs(mission: Mission, path: str, state: Mapping[str, Any]) -> None:
    """Every input that the node, or what is below it, reads before writing it must be in the checkpoint."""
    have = {name.removeprefix("port ") for name in state if name.startswith("port ")}
    missing: list[str] = []
    inside = _paths(mission)[path]
    around = [spec for above, spec in _paths(mission).items() if path.startswith(f"{above}/")]
    for spec in (*around, *inside.walk()):
        needed = kind_of(spec).required_keys(spec)
        missing += [f"{key!r} (read by {spec.name!r})" for key in needed if key not in have]
        have |= {wire.key for wire in spec.writes.values()}
    if missing:
        raise BadInput(f"--from {inside.name}: the checkpoint has no {', '.join(dict.fromkeys(missing))}")


def copy_run(folder: Path, to: Path) -> None:
    """The parts of a run that a resumption needs, in another folder.

    Raises:
        BadInput: It exists and is not empty, or cannot be written.
    """
    if to.exists() and any(to.iterdir()):
        raise BadInput(f"--out {to}: is not empty")
    file = CheckpointFile(folder / FILE)
    try:
        to.mkdir(parents=True, exist_ok=True)
        file.copy_to(to / FILE)
        for name in ("mission.yaml", "run.mcap"):
            if (folder / name).is_file():
                shutil.copy2(folder / name, to / name)
    except OSError as e:
        raise BadInput(f"--out {to}: cannot be written ({e.strerror})") from e
    finally:
        file.close()


def _link(source: Path, target: Path) -> None:
    """The same file under another name; a copy where the disk knows no links."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
