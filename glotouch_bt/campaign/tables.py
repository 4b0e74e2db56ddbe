"""The files that a campaign writes for people: CSV tables and summary.json."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from glotouch_bt.campaign.source import commit_of_source
from glotouch_bt.campaign.trial_folder import LOST, TrialFolder, claimed
from glotouch_bt.escaped_text import json_text
from glotouch_bt.runs import RunFolder


def write_table(folder: Path, name: str, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a CSV file atomically; further keys of the rows are left out."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, columns, extrasaction="ignore")
    table.writeheader()
    table.writerows(rows)
    write_alone(folder, name, text.getvalue())


def write_summary(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Write summary.json atomically, with null for numbers that are not finite; return what was written.

    It adds `commit`, and `lost_attempts`: the attempts at trials that died, hung or could not write, of which all but
    the last of a trial were repeated.
    """
    lost = sum(len(TrialFolder(path.parent).lost()) for path in folder.rglob(LOST))
    whole = {**summary, "lost_attempts": lost, "commit": commit_of_source()}
    write_alone(folder, "summary.json", json_text(whole))
    return whole


def write_alone(folder: Path, name: str, text: str) -> None:
    """Write a file of a folder that several commands may write at once.

    Raises:
        GlotouchError: The file cannot be written.
    """
    with claimed(folder, wait=True):
        RunFolder(folder).write_text(name, text)
