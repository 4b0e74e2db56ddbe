"""Start a faulted trial from a checkpoint of its unfaulted twin, so their common part runs only once.

The checkpoint holds tree, ports and world, so the trial equals the twin tick by tick until the fault begins.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

from glotouch_bt.faults import FaultPlan
from glotouch_bt.mission.checkpoint import CHECKPOINT_FILE, CheckpointFile, CheckpointRow
from glotouch_bt.runs import ResumableRun, copy_run, find_resumable, installed_versions
from glotouch_bt.validation.faults.rejoin import TwinWatch


def _first(rows: list[CheckpointRow], node: str) -> tuple[str, CheckpointRow, int] | None:
    """Return (path of the node, last checkpoint before its start, index of that row)."""
    for i, row in enumerate(rows[1:]):
        for path in row.begun:
            if path.rsplit("/", 1)[-1] == node:
                return path, rows[i], i
    return None


def start_from(
    twin: Path, out: Path, plan: FaultPlan, warm_up_s: float, objects: Path | None = None
) -> ResumableRun | None:
    """Copy the twin's run to `out`, resumable shortly before the fault; None if its node never ran.

    Args:
        twin: The folder of the unfaulted run.
        out: Folder of the trial; what is in it is removed.
        plan: Plan of one fault in the first run of a node.
        warm_up_s: Least run time before the fault begins, as far as the mission allows.
        objects: Folder of STL files, if the twin was made with one.

    Raises:
        BadInput: The twin's checkpoints cannot be used.
    """
    (spec,) = plan.faults
    file = CheckpointFile(twin / CHECKPOINT_FILE)
    try:
        rows = file.rows()
    finally:
        file.close()
    found = _first(rows, str(spec.when.node))
    if found is None:
        return None
    path, before, index = found
    begins_s = before.stamp_s + spec.when.after_s
    soon = [r for r in rows[: index + 1] if r.stamp_s <= begins_s - warm_up_s] or rows[:1]
    shutil.rmtree(out, ignore_errors=True)
    copy_run(twin, out)
    resumable = find_resumable(out, path, installed_versions(), objects=objects)
    resumable.file.close()
    return replace(resumable, file=TwinWatch(out, twin, plan, begins_s), row=soon[-1], start="")
