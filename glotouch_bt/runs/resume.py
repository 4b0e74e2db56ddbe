"""Resume an interrupted run from its newest checkpoint, or start it again at a node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from glotouch_bt.mission import Mission
from glotouch_bt.mission.execution import Control
from glotouch_bt.mission.record import RunSummary
from glotouch_bt.robot.simulation import TrueObject
from glotouch_bt.runs.folder import locked
from glotouch_bt.runs.launch import RunRequest, RunResult, launch
from glotouch_bt.runs.result import installed_versions
from glotouch_bt.runs.resume_point import ResumableRun, copy_run, find_resumable


def resume(
    folder: Path,
    *,
    start: str | None = None,
    out: Path | None = None,
    settings: Mapping[str, str] | None = None,
    objects: Path | None = None,
    on_found: Callable[[ResumableRun], None] | None = None,
    on_start: Callable[[Mission, Path], None] | None = None,
    on_truth: Callable[[list[TrueObject]], None] | None = None,
    on_progress: Callable[[float, RunSummary], None] | None = None,
    control: Control | None = None,
    report: bool = True,
) -> RunResult:
    """Resume a run in its own folder; replaced files move to `earlier/<number>` in it.

    The backend is opened with the same options. Those that name programs, files, addresses or devices must be given
    again, because the folder may come from a stranger. A simulated world is restored to the checkpoint. A fault plan
    is not applied again. On a real robot the world is checked before the mission continues.

    Args:
        folder: The run's folder.
        start: Node to start at: its name, its path, or the end of its path. In simulation the world is restored to
            the last start of that node.
        out: Resume a copy of the run in this folder instead.
        settings: Backend options.
        objects: Folder of STL files, if the run was made with one.
        on_found: Called with the resumable run before anything is opened.
        on_start, on_truth, on_progress, control: As for `launch`.
        report: Make report.html at the end.

    Raises:
        BadInput: The run cannot be resumed; nothing was changed.
        BackendError: The backend did not open.
    """
    given = (start, installed_versions(), settings, objects)
    if out is not None:
        find_resumable(folder, *given).file.close()  # raise before anything is copied
        with locked(folder):  # do not copy an active run
            copy_run(folder, out)
        folder = out
    resumable = find_resumable(folder, *given)
    try:
        asked = resumable.request
        if asked["faults"] is not None:
            resumable.notes.append(f"resumed without the faults of {asked['faults']}")
        if on_found is not None:
            on_found(resumable)
        request = RunRequest(
            **{name: asked[name] for name in ("mission", "backend", "seed", "conditions")},
            settings=settings or {},
            objects=objects,
            out=folder,
            report=report,
        )
        return launch(
            request,
            on_start=on_start,
            on_truth=on_truth,
            on_progress=on_progress,
            control=control,
            resumable=resumable,
        )
    finally:
        resumable.file.close()
