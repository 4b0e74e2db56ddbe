"""`glotouch tree`: a mission's tree as a drawing."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.shared import AllowPaths, MissionName, Objects, Settings, guarded, read_settings


class TreeFormat(StrEnum):
    """Formats of the drawing."""

    text = "text"
    svg = "svg"
    btcpp = "btcpp"


@guarded
def tree(
    mission: MissionName,
    format_: Annotated[TreeFormat, typer.Option("--format", help="text, a picture, or BehaviorTree.CPP XML")] = (
        TreeFormat.text
    ),
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="file to write instead of stdout")] = None,
    set_: Settings = None,
    objects: Objects = None,
    allow_path: AllowPaths = None,
) -> None:
    """Draw a mission's tree."""
    from glotouch_bt.mission import load_mission
    from glotouch_bt.mission.export import as_btcpp, as_svg, as_text
    from glotouch_bt.robot import BadInput

    loaded = load_mission(mission, read_settings(set_), objects=objects, allow_paths=allow_path or ())
    drawn = {TreeFormat.text: as_text, TreeFormat.svg: as_svg, TreeFormat.btcpp: as_btcpp}[format_](loaded)
    if out is None:
        sys.stdout.write(drawn)
        return
    try:
        out.write_text(drawn, encoding="utf-8")
    except OSError as e:
        raise BadInput(f"--out {out}: cannot be written ({e.strerror})") from e
