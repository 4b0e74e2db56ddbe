"""`glotouch replay`: a run recomputed from its record, without a robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.shared import Json, RunFolderArgument, check_run, guarded, print_json

MAX_DIFFERENCES = 12
"""Number of differences to print."""


@guarded
def replay(
    folder: RunFolderArgument,
    objects: Annotated[
        Path | None, typer.Option("--objects", metavar="DIR", help="folder of its STL files, if they have moved")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(help="largest difference of equal numbers, absolute (SI) or relative", min=0.0)
    ] = 1e-4,
    decisions: Annotated[
        bool,
        typer.Option("--decisions", help="only match the recorded TouchSets again (works for records of any version)"),
    ] = False,
    json_: Json = False,
) -> int:
    """Recompute a run from its record and show what differs.

    Computes every fit, match and decision again from the recorded observations. Needs no robot and no simulator. The
    code that made the run gives no difference; other code shows its effect on this run. Exit code 1: differences.
    """
    from rich.progress import BarColumn, Progress, TextColumn

    from glotouch_bt.commands.terminal import EscapingConsole
    from glotouch_bt.runs.replay import as_dict, as_lines, decision_as_dict, replay_decisions
    from glotouch_bt.runs.replay import replay as run_replay

    check_run(folder)
    if decisions:
        made = replay_decisions(folder, objects=objects)
        if json_:
            print_json([decision_as_dict(d) for d in made])
        else:
            sys.stdout.write("\n".join(map(str, made)) + "\n" if made else "this run made no decision\n")
        return 0 if all(d.same for d in made) else 1
    columns = (TextColumn("replaying"), BarColumn(), TextColumn("{task.completed:.0f} of {task.total:.0f} s"))
    err = EscapingConsole(stderr=True)
    quiet = json_ or not err.is_terminal
    with Progress(
        *columns, console=err, transient=True, disable=quiet, redirect_stdout=False, redirect_stderr=False
    ) as progress:
        task = progress.add_task("", total=1.0)
        done = run_replay(
            folder,
            objects=objects,
            tolerance=tolerance,
            on_progress=lambda s, total_s: progress.update(task, completed=s, total=total_s),
        )
    if json_:
        print_json(as_dict(done))
    else:
        sys.stdout.write("\n".join(as_lines(done, MAX_DIFFERENCES)) + "\n")
    return 0 if done.same else 1
