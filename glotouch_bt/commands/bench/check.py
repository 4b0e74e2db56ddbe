"""`glotouch bench check`: the share of seeded mistakes that `glotouch check` finds."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.shared import Json, guarded, print_json


@guarded
def check(
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder to write summary.json and table.md to")
    ] = None,
    json_: Json = False,
) -> None:
    """Seeded mistakes: how many `glotouch check` finds.

    The table also gives what py_trees alone finds, and the false alarms on missions without a mistake.
    """
    from glotouch_bt.robot import BadInput
    from glotouch_bt.validation.seeded_mistakes import as_markdown, compare, summary

    rows = compare()
    counted = summary(rows)
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
            (out / "summary.json").write_text(json.dumps(counted, indent=2) + "\n", encoding="utf-8")
            (out / "table.md").write_text(as_markdown(rows), encoding="utf-8")
        except OSError as e:
            raise BadInput(f"--out {out}: cannot be written ({e.strerror})") from e
    if json_:
        print_json(counted)
        return
    sys.stdout.write(as_markdown(rows) + "\n" + "".join(f"{k}: {v}\n" for k, v in counted.items()))
