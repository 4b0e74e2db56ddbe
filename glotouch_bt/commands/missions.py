"""`glotouch missions`: the shipped missions."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from glotouch_bt.commands.shared import Json, guarded, print_json

KINDS = {"subtrees": "subtree", "worlds": "world", "conditions": "profile of conditions", "faults": "fault plan"}
"""Folders of shipped files that are no missions, and what a file in them is called."""


@guarded
def missions(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one mission")] = None, json_: Json = False
) -> None:
    """List the shipped missions, or describe one.

    The list also names the shipped subtrees, worlds, conditions and fault plans.
    """
    from glotouch_bt.commands.terminal import print_settings, print_table
    from glotouch_bt.mission.export import describe_mission
    from glotouch_bt.mission.read import shipped
    from glotouch_bt.robot import BadInput, UnknownName

    known = shipped("")
    if name is not None and name not in known:
        for kind, called in KINDS.items():
            if path := shipped(kind).get(name):
                raise BadInput(f"{name!r} is a shipped {called}, not a mission; its file is {path}")
        raise UnknownName("mission", name, known)
    described = [describe_mission(known[n]) for n in ([name] if name else known)]
    if json_:
        print_json(described[0] if name else described)
        return
    if name is None:
        rows = [(d["name"], d["description"], ", ".join(p["name"] for p in d["parameters"])) for d in described]
        print_table("missions", ("name", "description", "parameters (--set NAME=VALUE)"), rows)
        for kind in KINDS:
            sys.stdout.write(f"{'fault plans' if kind == 'faults' else kind}: {', '.join(shipped(kind))}\n")
        return
    (d,) = described
    sys.stdout.write(f"{d['name']}: {d['description']}\n{d['file']}\nworld {d['world']}\n")
    print_settings("parameters", d["parameters"])
