"""A faulted trial goes on from a checkpoint of its unfaulted twin: what they have in common is run once.

The checkpoint holds tree, ports and world, so that the trial is the twin, tick by tick, until the fault begins.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from glotouch_bt.mission.checkpoint import FILE, CheckpointFile, Row
from glotouch_bt.study.going_on import GoingOn, copy_run, find
from glotouch_bt.study.result import installed_versions


def _first(rows: list[Row], node: str) -> tuple[str, Row, int] | None:
    """(path, the checkpoint before it began, its place among the rows)."""
    for i, row in enumerate(rows[1:]):
        for path in row.begun:
            if path.rsplit("/", 1)[-1] == node:
                return path, rows[i], i
    return None


def start_from(twin: Path, out: Path, node: str, after_s: float, warm_up_s: float) -> GoingOn | None:
    """A copy of the twin's run in `out`, to go on with shortly before a fault; None if there is nothing to save.

    Args:
        twin: The folder of the unfaulted run.
        out: Folder of the trial; what is in it is removed.
        node: In whose first run the fault begins,
        after_s: and how long after that began.
        warm_up_s: The trial runs for at least so long before the fault begins.

    Raises:
        BadInput: The twin's checkpoints cannot be used.
    """
    file = CheckpointFile(twin / FILE)
    try:
        rows = file.rows()
    finally:
        file.close()
    found = _first(rows, node)
    if found is None:
        return None
    path, before, index = found
    soon = [r for r in rows[: index + 1] if r.stamp_s <= before.stamp_s + after_s - warm_up_s]
    if not soon or soon[-1].number == rows[0].number:
        return None
    shutil.rmtree(out, ignore_errors=True)
    copy_run(twin, out)
    return replace(find(out, path, installed_versions()), row=soon[-1], start="")
