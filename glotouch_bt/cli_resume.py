"""`glotouch resume`: go on with a run that was broken off."""

from __future__ import annotations

import json
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.guarded import guarded, showing_tracebacks

Json = Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")]


@guarded
def resume(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="folder of a run that was broken off")],
    from_: Annotated[
        str | None, typer.Option("--from", metavar="NODE", help="start at this node (its name or path) instead")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="go on in a copy of the run there")] = None,
    list_: Annotated[bool, typer.Option("--list", help="only show the checkpoints")] = False,
    json_: Json = False,
) -> int:
    """Go on with a run after a crash, a kill, Ctrl-C or a safety stop; finished skills are not done again."""
    from glotouch_bt import console
    from glotouch_bt.study.going_on import GoingOn
    from glotouch_bt.study.resume import resume as go_on

    if list_:
        _list(folder, json_)
        return 0

    def tell(found: GoingOn) -> None:
        if json_:
            return
        row = found.row
        after = f"after {row.node}" if row.node else "before the first skill"
        where = f", starting at {found.start}" if found.start else ""
        sys.stderr.write(f"checkpoint {row.number}, t = {row.stamp_s:.1f} s, {after}{where}\n")
        for note in found.notes:
            sys.stderr.write(f"note: {note}\n")

    with console.RunProgress(quiet=json_) as progress:
        done = go_on(folder, start=from_, out=out, on_found=tell, on_start=progress.start, on_progress=progress.update)
    if json_:
        sys.stdout.write(json.dumps({**done.result, "folder": str(done.folder)}, indent=2) + "\n")
    else:
        console.print_result(done)
    if done.warning:
        console.print_error(done.warning)
    if done.outcome.error is not None:
        if showing_tracebacks():
            traceback.print_exception(done.outcome.error)
        console.print_error(done.outcome.reasons[-1])
    return done.exit_code


def _list(folder: Path, json_: bool) -> None:
    from glotouch_bt import console
    from glotouch_bt.mission.checkpoint import FILE, CheckpointFile

    file = CheckpointFile(folder / FILE)
    rows, run = file.rows(), file.run
    file.close()
    if json_:
        told = [
            {"number": r.number, "at_s": r.stamp_s, "node": r.node, "status": r.status, "begun": list(r.begun),
             "lacking": dict(r.lacking), "world": r.has_world}
            for r in rows
        ]  # fmt: skip
        sys.stdout.write(json.dumps({"ended": run.get("ended"), "checkpoints": told}, indent=2) + "\n")
        return
    table = [
        (str(r.number), f"{r.stamp_s:.1f}", r.node or "(before the first skill)", r.status, ", ".join(r.lacking))
        for r in rows
    ]
    title = f"checkpoints of {folder} ({run.get('ended') or 'broken off'})"
    console.print_table(title, ("number", "t [s]", "after", "status", "lacks"), table)
