"""Options that several commands take, and the checks of their values."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from glotouch_bt.campaign import Shard
    from glotouch_bt.mission import Mission

_NUMBER = re.compile("[-+]?[0-9.]+")
MissionName = Annotated[
    str, typer.Argument(metavar="MISSION", help="path of a mission file, or the name of a shipped mission")
]
RunFolderArgument = Annotated[Path, typer.Argument(metavar="RUN", help="a run's folder")]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter or backend option")
]
MissionSettings = Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a mission parameter")]
BackendSettings = Annotated[list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="a backend option")]
Objects = Annotated[
    Path | None,
    typer.Option("--objects", metavar="DIR", help="folder of watertight STL files in metres (see: glotouch objects)"),
]
WorldName = Annotated[
    str | None, typer.Option("--world", metavar="WORLD", help="a world file or shipped name, instead of the mission's")
]
AllowPaths = Annotated[
    list[Path] | None,
    typer.Option("--allow-path", metavar="DIR", help="further folder that the mission's subtrees may be in"),
]
Backend = Annotated[str, typer.Option(help="a registered backend (see: glotouch backends)")]
Conditions = Annotated[
    str,
    typer.Option(
        help="disturbances: ideal, nominal, harsh, realistic, strong, or a file; NAME+FIELD=VALUE changes a field"
    ),
]
SetConditions = Annotated[
    list[str] | None,
    typer.Option(
        "--set-condition", metavar="FIELD=VALUE", help="change a field of the conditions; a range as LOW,HIGH"
    ),
]
Live = Annotated[bool, typer.Option("--live", help="show the mission in the browser while it runs")]
Port = Annotated[
    int | None, typer.Option(min=1, max=65535, help="port of the page on 127.0.0.1 (default: the next free one)")
]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="do not open the page in the browser")]
GROOT2_PORT = 1667
"""Port that Groot2 connects to first. Source: BehaviorTree.CPP 4.10, `Groot2Publisher`."""
Groot2 = Annotated[
    int | None,
    typer.Option(
        "--groot2",
        metavar="[PORT]",
        min=1,
        max=65534,
        help=f"show the tree in Groot2, on this port of 127.0.0.1 and the next (default: {GROOT2_PORT})",
    ),
]
BARE_VALUES = {"--groot2": str(GROOT2_PORT)}
"""Value of an option that may stand without one."""
Json = Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")]

Trials = Annotated[int, typer.Option(min=1, help="number of seeds")]
FirstSeed = Annotated[int, typer.Option(min=0, help="first seed")]
Workers = Annotated[int, typer.Option(min=1, help="worker processes")]
TRIAL_LIMIT_S = 1800.0
"""Default wall time after which a trial counts as hanging. Source: ours, thirty times the wall time of a mission."""
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="run the trials on a dask cluster: its scheduler's address, or local"),
]
ShardName = Annotated[
    str | None,
    typer.Option("--shard", metavar="I/N", help="run every N-th trial only, from number I; for batch queues"),
]
TrialLimit = Annotated[
    float, typer.Option("--trial-limit", min=0.1, help="wall time after which a trial counts as hanging, s")
]
BenchFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="folder of trials and summary (default: runs/...-bench-...)")
]
SummaryJson = Annotated[bool, typer.Option("--json", help="print summary.json on stdout, nothing else")]
KeepTrials = Annotated[bool, typer.Option("--resume", help="keep the trials that --out already holds")]
FewObjects = Annotated[int, typer.Option(min=1, help="put only the first N objects into the box, which is faster")]


def with_bare_values(words: list[str]) -> list[str]:
    """Return a command line in which every option of `BARE_VALUES` has a value; its own value must be a number."""
    end = words.index("--") if "--" in words else len(words)
    followed = zip_longest(words[:end], words[1:end], fillvalue="")
    made = [f"{w}={BARE_VALUES[w]}" if w in BARE_VALUES and not _NUMBER.fullmatch(n) else w for w, n in followed]
    return [*made, *words[end:]]


def check_names(conditions: str, backend: str) -> None:
    """Check that both exist, before anything is written.

    Raises:
        BadInput: One does not exist; the message lists those that do.
    """
    from glotouch_bt.mission.read import load_conditions
    from glotouch_bt.robot import load_backend

    load_conditions(conditions)
    load_backend(backend)


def check_parameters(mission: Mission, needed: Iterable[str]) -> None:
    """Check that a mission declares the parameters that an experiment sets.

    Raises:
        BadInput: One is missing.
    """
    from glotouch_bt.robot import BadInput

    missing = [name for name in needed if name not in mission.parameters]
    if missing:
        raise BadInput(
            f"--mission {mission.name}: this experiment sets the parameter{'s' * (len(missing) > 1)} "
            f"{', '.join(missing)}, which the mission does not declare "
            f"(its parameters: {', '.join(mission.parameters) or 'none'}); use a mission such as retrieve"
        )


def check_run(folder: Path) -> None:
    """Require that a folder holds a run.

    Raises:
        BadInput: It does not; the newest run below ./runs is named.
    """
    from glotouch_bt.robot import BadInput

    if folder.is_file():
        raise BadInput(f"{folder}: give the run's folder, not a file in it")
    if not any((folder / name).exists() for name in ("run.mcap", "checkpoint.sqlite")):
        runs = sorted(Path("runs").glob("*/run.mcap"), key=lambda file: file.stat().st_mtime)
        newest = f" (newest here: {runs[-1].parent})" if runs else ""
        raise BadInput(f"{folder}: no run here; give the folder that `glotouch run` printed{newest}")


def bench_folder(out: Path | None, name: str) -> Path:
    """Return the experiment's folder, after a check that it can be written; leave nothing there.

    Raises:
        BadInput: No file can be written there.
    """
    from glotouch_bt.runs import RunFolder

    folder = out or Path("runs") / f"{time.strftime('%Y%m%d-%H%M%S')}-bench-{name}"
    RunFolder(folder).discard()
    return folder


def read_shard(given: str | None) -> Shard | None:
    """Return the share that --shard names.

    Raises:
        BadInput: It is not I/N.
    """
    from glotouch_bt.campaign import Shard

    return None if given is None else Shard.parse(given)


def changed_conditions(conditions: str, changes: list[str] | None) -> str:
    """Return a profile with FIELD=VALUE words added to it.

    Raises:
        BadInput: As `read_settings`.
    """
    given = read_settings(changes, "--set-condition")
    return "+".join([conditions, *(f"{name}={value.strip()}" for name, value in given.items())])


def read_settings(given: list[str] | None, option: str = "--set") -> dict[str, str]:
    """Return the NAME=VALUE words of an option as a mapping.

    Raises:
        BadInput: A word without "=", or a name given twice.
    """
    from glotouch_bt.robot import BadInput

    settings: dict[str, str] = {}
    for item in given or []:
        name, equals, value = item.partition("=")
        if not equals or not name.strip():
            raise BadInput(f"{option} {item}: must be NAME=VALUE")
        if name.strip() in settings:
            raise BadInput(f"{option} {name.strip()}: given twice")
        settings[name.strip()] = value
    return settings
