"""`glotouch nodes`: the nodes of the mission language. `glotouch schema`: the JSON Schema of mission files."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from glotouch_bt.commands.shared import Json, guarded, print_json


@guarded
def nodes(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one node")] = None, json_: Json = False
) -> None:
    """List the nodes of the mission language, or describe one."""
    from glotouch_bt.commands.terminal import print_settings, print_table
    from glotouch_bt.mission.export import describe_nodes
    from glotouch_bt.robot import UnknownName

    known = {d["name"]: d for d in describe_nodes()}
    if name is not None and name not in known:
        raise UnknownName("node", name, known)
    if json_:
        print_json(known[name] if name else list(known.values()))
        return
    if name is None:
        rows = [
            (d["name"], d["children"], ", ".join(s["name"] for s in d["settings"]), d["description"])
            for d in known.values()
        ]
        print_table("nodes", ("name", "children", "settings", "description"), rows)
        return
    d = known[name]
    sys.stdout.write(f"{name}: {d['description']}\nchildren: {d['children']}\n")
    print_settings("settings", d["settings"])


@guarded
def schema() -> None:
    """Print the JSON Schema of mission files, for editors."""
    from glotouch_bt.mission.export import mission_schema
    from glotouch_bt.mission.read import SkillRegistry

    print_json(mission_schema(SkillRegistry()))
