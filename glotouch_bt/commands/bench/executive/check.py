"""`glotouch bench check`: the share of seeded mistakes that `glotouch check` finds."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands import shared


@shared.guarded
def check(
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder to write summary.json and table.md to")
    ] = None,
    json_: shared.Json = False,
) -> None:
    """Seeded mistakes: how many `glotouch check` finds.

    The table also gives what py_trees alone finds, and the false alarms on missions without a mistake.
    """
    from glotouch_bt.campaign import write_summary
    from glotouch_bt.runs import RunFolder
    from glotouch_bt.validation.seeded_mistakes import as_markdown, compare, summary

    rows = compare()
    counted = summary(rows)
    if out is not None:
        write_summary(out, counted)
        RunFolder(out).write_text("table.md", as_markdown(rows))
    if json_:
        shared.print_json(counted)
        return
    sys.stdout.write(as_markdown(rows) + "\n" + "".join(f"{k}: {v}\n" for k, v in counted.items()))
