"""`glotouch resume`: a broken-off run goes on from its newest checkpoint, or starts again at a node."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from glotouch_bt.mission import Mission
from glotouch_bt.mission.execution import Control
from glotouch_bt.mission.record import RunSummary
from glotouch_bt.runs.folder import claimed
from glotouch_bt.runs.launch import RunRequest, RunResult, launch
from glotouch_bt.runs.result import installed_versions
from glotouch_bt.runs.resume_point import ResumableRun, copy_run, find


def resume(
    folder: Path,
    *,
    start: str | None = None,
    out: Path | None = None,
    on_found: Callable[[ResumableRun], None] | None = None,
    on_start: Callable[[Mission, Path], None] | None = None,
    on_progress: Callable[[float, RunSummary], None] | None = None,
    control: Control | None = None,
    report: bool = True,
) -> RunResult:
    """Go on with a run in its own folder; what that replaces moves to `earlier/<number>` in it.

    The backend is opened as it was. A simulated world goes back to what it was at the checkpoint, faults of a fault
    plan are left out; on a real robot the world is where it is, and is looked at before the mission goes on.

    Args:
        folder: The run's folder.
        start: A node to start at, whatever came next: its name, its path, or the end of its path. In simulation the
            world is the one in which the node last began.
        out: Go on in a copy of the run in this folder instead.
        on_found: Called with what was found, before anything is opened.
        on_start, on_progress, control: As for `launch`.
        report: Make report.html at the end.

    Raises:
        BadInput: Nothing to go on from; nothing was changed.
        BackendError: The backend did not open.
    """
    if out is not None:
        find(folder, start, installed_versions()).file.close()  # complain before anything is copied
        with claimed(folder):  # a run under way is not copied in the middle
            copy_run(folder, out)
        folder = out
    resumable = find(folder, start, installed_versions())
    try:
        asked = resumable.request
        if asked["faults"] is not None:
            resumable.notes.append(f"goes on without the faults of {asked['faults']}")
        if on_found is not None:
            on_found(resumable)
        request = RunRequest(
            mission=asked["mission"],
            backend=asked["backend"],
            seed=asked["seed"],
            settings=asked["settings"],
            objects=None if asked["objects"] is None else Path(asked["objects"]),
            conditions=asked["conditions"],
            out=folder,
            report=report,
        )
        return launch(request, on_start=on_start, on_progress=on_progress, control=control, resumable=resumable)
    finally:
        resumable.file.close()
