"""`glotouch bench compare`: two campaigns on the same layouts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands import shared


@shared.guarded
def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="folder of a campaign (the --out of a bench)")],
    b: Annotated[Path, typer.Argument(metavar="B", help="folder of another campaign of the same bench")],
    json_: shared.Json = False,
) -> None:
    """Paired comparison of two campaigns: two commits, missions, conditions or options.

    Trials are paired by seed, target and whatever else their folder is named after. Differences are B minus A, with
    95 % intervals over independent worlds (seeds); rates also get McNemar's exact test over trials.
    """
    from glotouch_bt.bench.compare import compare_folders
    from glotouch_bt.commands.terminal import print_comparison

    found = compare_folders(a, b)
    if json_:
        shared.print_json(found)
    else:
        print_comparison(found)
