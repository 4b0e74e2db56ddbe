"""Options that several commands take, and what becomes of them."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

Trials = Annotated[int, typer.Option(min=1, help="seeds per target")]
Seed = Annotated[int, typer.Option(min=0, help="first seed")]
Workers = Annotated[int, typer.Option(min=1, help="processes")]
Conditions = Annotated[str, typer.Option(help="disturbances: ideal, nominal, harsh, or a file")]
Objects = Annotated[Path | None, typer.Option(metavar="DIR", help="folder of watertight STL files in metres")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="where trials and summary go (default: runs/bench-...)")]
Json = Annotated[bool, typer.Option("--json", help="print summary.json on stdout, nothing else")]


def check_names(conditions: str, backend: str) -> None:
    """Before anything is written: both must exist.

    Raises:
        BadInput: One does not; the message lists those that do.
    """
    from glotouch_bt.mission.read import load_conditions
    from glotouch_bt.robot import load_backend

    load_conditions(conditions)
    load_backend(backend)


def bench_folder(out: Path | None, name: str) -> Path:
    """Where the experiment's files go; nothing is left there yet.

    Raises:
        BadInput: No file can be written there.
    """
    from glotouch_bt.run import RunFolder

    folder = out or Path("runs") / f"{time.strftime('%Y%m%d-%H%M%S')}-bench-{name}"
    RunFolder(folder).abandon()
    return folder


def read_settings(given: list[str] | None) -> dict[str, str]:
    """NAME=VALUE words as a mapping.

    Raises:
        BadInput: A word without "=", or a name given twice.
    """
    from glotouch_bt.robot import BadInput

    settings: dict[str, str] = {}
    for item in given or []:
        name, equals, value = item.partition("=")
        if not equals or not name.strip():
            raise BadInput(f"--set {item}: must be NAME=VALUE")
        if name.strip() in settings:
            raise BadInput(f"--set {name.strip()}: given twice")
        settings[name.strip()] = value
    return settings
