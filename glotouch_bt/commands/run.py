"""`glotouch run`: one mission on one robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands import shared


@shared.guarded
def run(
    mission: shared.MissionName,
    backend: shared.Backend = "mujoco",
    seed: Annotated[int, typer.Option(help="source of every random draw")] = 0,
    set_: shared.Settings = None,
    objects: shared.Objects = None,
    world: shared.WorldName = None,
    allow_path: shared.AllowPaths = None,
    conditions: shared.Conditions = "nominal",
    set_condition: shared.SetConditions = None,
    faults: Annotated[
        str | None, typer.Option(metavar="PLAN", help="a fault plan, file or shipped name (see: glotouch faults)")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="the run's folder (default: runs/...)")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the run that --out holds")] = False,
    live: shared.Live = False,
    port: shared.Port = None,
    no_browser: shared.NoBrowser = False,
    groot2: shared.Groot2 = None,
    json_: shared.Json = False,
) -> int:
    """Run a mission; write its record, result and report.

    `p` or SIGUSR1 pauses and continues it, SIGTERM ends it safely. With --live, so does the page in the browser.
    """
    from glotouch_bt.commands.terminal import RunProgress, print_end
    from glotouch_bt.runs import Operator, RunRequest, launch, operated

    request = RunRequest(
        mission,
        backend,
        seed,
        shared.read_settings(set_),
        objects,
        shared.changed_conditions(conditions, set_condition),
        out,
        faults,
        may_kill=True,
        overwrite=overwrite,
        allow_paths=tuple(allow_path or ()),
        world=world,
    )
    control = Operator()
    with shared.live_page(live, control, port, no_browser, objects) as page, shared.live_tree(groot2) as tree:
        with RunProgress(quiet=json_) as progress, operated(control):
            start, truth = shared.shown_on(page, tree, progress.start)
            done = launch(request, on_start=start, on_truth=truth, on_progress=progress.update, control=control)
        code = print_end(done, json_)
        shared.wait_for_viewers(page, done)
    return code
