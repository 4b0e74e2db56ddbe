"""The files that a campaign writes for people: CSV tables and summary.json."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from glotouch_bt.campaign.trial_folder import claimed
from glotouch_bt.escaped_text import json_text
from glotouch_bt.runs import RunFolder


def write_table(folder: Path, name: str, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a CSV file atomically; further keys of the rows are left out."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, columns, extrasaction="ignore")
    table.writeheader()
    table.writerows(rows)
    write_alone(folder, name, text.getvalue())


def write_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Write summary.json atomically, with null for numbers that are not finite."""
    write_alone(folder, "summary.json", json_text(summary))


def write_alone(folder: Path, name: str, text: str) -> None:
    """Write a file of a folder that several commands may write at once.

    Raises:
        GlotouchError: The file cannot be written.
    """
    with claimed(folder, wait=True):
        RunFolder(folder).write_text(name, text)
