"""`glotouch replay`: a run done again from its record, without a robot, beside what it was."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.terminal import guarded

SHOWN = 12


@guarded
def replay(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="a run's folder")],
    objects: Annotated[
        Path | None, typer.Option("--objects", metavar="DIR", help="its STL files, if they are elsewhere now")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(help="numbers are the same within this, absolute (SI) or relative", min=0.0)
    ] = 1e-4,
    decisions: Annotated[
        bool, typer.Option("--decisions", help="only match again the TouchSets of the record (any version's)")
    ] = False,
    json_: Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")] = False,
) -> int:
    """Make every fit, match and decision of a run again from what it sensed, and show what differs.

    Needs no robot and no simulator. With the code that made the run nothing differs; with other code the differences
    are what the change does to this run. Exit code 1 if something differs.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from glotouch_bt.run.replay import as_dict, as_lines, decision_as_dict, replay_decisions
    from glotouch_bt.run.replay import replay as run_replay

    if decisions:
        made = replay_decisions(folder, objects=objects)
        if json_:
            _print_json([decision_as_dict(d) for d in made])
        else:
            sys.stdout.write("\n".join(map(str, made)) + "\n" if made else "no decision was made in this run\n")
        return 0 if all(d.same for d in made) else 1
    columns = (TextColumn("replaying"), BarColumn(), TextColumn("{task.completed:.0f} of {task.total:.0f} s"))
    err = Console(stderr=True)
    with Progress(*columns, console=err, transient=True, disable=json_ or not err.is_terminal) as progress:
        task = progress.add_task("", total=1.0)
        done = run_replay(
            folder,
            objects=objects,
            tolerance=tolerance,
            on_progress=lambda s, total_s: progress.update(task, completed=s, total=total_s),
        )
    if json_:
        _print_json(as_dict(done))
    else:
        sys.stdout.write("\n".join(as_lines(done, SHOWN)) + "\n")
    return 0 if done.same else 1


def _print_json(data: object) -> None:
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False, default=str) + "\n")
