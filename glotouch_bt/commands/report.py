"""`glotouch report`: the report of a finished run."""

from __future__ import annotations

import sys

from glotouch_bt.commands.shared import Json, RunFolderArgument, guarded, print_json


@guarded
def report(folder: RunFolderArgument, json_: Json = False) -> None:
    """Write report.html of a run again."""
    from glotouch_bt.report import write_report

    made = write_report(folder)
    if json_:
        print_json({"report": str(made)})
    else:
        sys.stdout.write(f"{made}\n")
