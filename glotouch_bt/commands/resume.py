"""`glotouch resume`: continue an interrupted run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.shared import (
    BackendSettings,
    Groot2,
    Json,
    Live,
    NoBrowser,
    Objects,
    Port,
    check_run,
    guarded,
    live_page,
    live_tree,
    print_json,
    read_settings,
    shown_on,
    wait_for_viewers,
)


@guarded
def resume(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="folder of an interrupted run")],
    from_: Annotated[
        str | None, typer.Option("--from", metavar="NODE", help="start at this node (name or path) instead")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="continue in a copy of the run in this folder")
    ] = None,
    set_: BackendSettings = None,
    objects: Objects = None,
    live: Live = False,
    port: Port = None,
    no_browser: NoBrowser = False,
    groot2: Groot2 = None,
    list_: Annotated[bool, typer.Option("--list", help="only show the checkpoints")] = False,
    json_: Json = False,
) -> int:
    """Continue an interrupted run from its last checkpoint.

    After a crash, a kill, Ctrl-C or a safety stop. Finished skills do not run again. A run's folder names no programs,
    paths, addresses and devices: give those of the run again.
    """
    from glotouch_bt.commands.terminal import RunProgress, print_end
    from glotouch_bt.runs import Operator, ResumableRun, operated
    from glotouch_bt.runs import resume as resume_run

    check_run(folder)
    if list_:
        _list(folder, json_)
        return 0

    shown: list[str] = []

    def show(found: ResumableRun) -> None:
        shown.extend(found.notes)
        if json_:
            return
        row = found.row
        after = f"after {row.node}" if row.node else "before the first skill"
        where = f", starting at {found.start}" if found.start else ""
        sys.stderr.write(f"checkpoint {row.number}, t = {row.stamp_s:.1f} s, {after}{where}\n")
        for note in found.notes:
            sys.stderr.write(f"note: {note}\n")

    control = Operator()
    with live_page(live, control, port, no_browser, objects) as page, live_tree(groot2) as tree:
        with RunProgress(quiet=json_) as progress, operated(control):
            on_start, truth = shown_on(page, tree, progress.start)
            done = resume_run(
                folder,
                start=from_,
                out=out,
                settings=read_settings(set_),
                objects=objects,
                on_found=show,
                on_start=on_start,
                on_truth=truth,
                on_progress=progress.update,
                control=control,
            )
        for note in done.result["resumed"][-1]["notes"] if not json_ else ():
            if note not in shown:  # found while the record was copied
                sys.stderr.write(f"note: {note}\n")
        code = print_end(done, json_)
        wait_for_viewers(page, done)
    return code


def _list(folder: Path, json_: bool) -> None:
    from glotouch_bt.commands.terminal import print_table
    from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile

    file = CheckpointFile(folder / CHECKPOINT_FILE)
    rows, run = file.rows(), file.run
    file.close()
    if json_:
        checkpoints = [
            {"number": r.number, "at_s": r.stamp_s, "node": r.node, "status": r.status, "begun": list(r.begun),
             "lacking": dict(r.lacking), "world": r.has_world}
            for r in rows
        ]  # fmt: skip
        print_json({"ended": run.get("ended"), "checkpoints": checkpoints})
        return
    table = [
        (str(r.number), f"{r.stamp_s:.1f}", r.node or "(before the first skill)", r.status, ", ".join(r.lacking))
        for r in rows
    ]
    title = f"checkpoints of {folder} ({run.get('ended') or 'interrupted'})"
    print_table(title, ("number", "t [s]", "after", "status", "lacks"), table)
