"""`glotouch report` and `glotouch view`: a run as a file, and as a page in the browser."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.shared import (
    BackendSettings,
    Groot2,
    Json,
    NoBrowser,
    Port,
    RunFolderArgument,
    check_run,
    guarded,
    print_json,
    read_settings,
)

RunObjects = Annotated[
    Path | None, typer.Option("--objects", metavar="DIR", help="folder of the STL files, to show the objects")
]


@guarded
def report(
    folder: RunFolderArgument,
    film: Annotated[bool, typer.Option("--film", help="render moments of a simulated run into it")] = False,
    objects: RunObjects = None,
    set_: BackendSettings = None,
    json_: Json = False,
) -> None:
    """Write report.html of a run again.

    --film draws the world as it was when skills had ended. Without a display it needs MUJOCO_GL=egl. A run with a robot
    of one's own needs --set robot=FILE.
    """
    from glotouch_bt.commands.terminal import print_error
    from glotouch_bt.report import write_report
    from glotouch_bt.robot import GlotouchError
    from glotouch_bt.runs import write_film

    check_run(folder)
    if film:
        try:
            write_film(folder, objects, read_settings(set_))
        except GlotouchError as e:
            print_error(f"no film: {e}")
    made = write_report(folder, objects)
    if json_:
        print_json({"report": str(made)})
    else:
        sys.stdout.write(f"{made}\n")


@guarded
def view(
    folder: RunFolderArgument,
    port: Port = None,
    no_browser: NoBrowser = False,
    objects: RunObjects = None,
    groot2: Groot2 = None,
) -> None:
    """Show a run in the browser: scene, tree, signals and a time line.

    A run under way is followed. Only this machine can open the page. Ctrl-C ends it. Nothing is written.
    """
    from glotouch_bt.view import view_run

    check_run(folder)

    def ready(address: str) -> None:
        sys.stdout.write(f"{address}   (Ctrl-C ends the page)\n")
        if groot2 is not None:
            sys.stdout.write(f"for Groot2: 127.0.0.1:{groot2}\n")
        sys.stdout.flush()

    with suppress(KeyboardInterrupt):
        view_run(folder, port=port, browser=not no_browser, objects=objects, groot2=groot2, on_ready=ready)
