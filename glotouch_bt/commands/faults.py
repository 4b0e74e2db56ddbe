"""`glotouch faults`: the catalogue of faults."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from glotouch_bt.commands.shared import Json, guarded, print_json


@guarded
def faults(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one fault")] = None,
    json_: Json = False,
) -> None:
    """List the faults of a fault plan, or describe one.

    `glotouch run MISSION --faults PLAN` runs a plan.
    """
    from glotouch_bt.commands.terminal import print_table
    from glotouch_bt.faults import CATALOGUE
    from glotouch_bt.mission.read import shipped
    from glotouch_bt.robot import BadInput, UnknownName

    if name is not None and name not in CATALOGUE:
        if name in shipped("faults"):
            raise BadInput(f"{name!r} is a fault plan; run it with --faults {name}")
        raise UnknownName("fault", name, CATALOGUE)
    kinds = [CATALOGUE[name]] if name else list(CATALOGUE.values())
    if json_:
        described = [k.as_dict() for k in kinds]
        print_json(described[0] if name else described)
        return
    if name is None:
        rows = [(k.name, k.channel, "yes" if k.recoverable else "no", k.summary, k.seen_by) for k in kinds]
        print_table("faults", ("name", "channel", "recoverable", "effect", "detected by"), rows)
        sys.stdout.write(f"shipped plans: {', '.join(shipped('faults')) or 'none'}\n")
        return
    kind = kinds[0]
    where = " (simulation only)" if kind.channel == "world" else ""
    sys.stdout.write(f"{kind.name}: {kind.summary}{where}\n")
    sys.stdout.write(f"channel {kind.channel}; detected by {kind.seen_by}; ")
    sys.stdout.write(f"{'recoverable' if kind.recoverable else 'ends the mission'}\n")
    parameters = [
        (p["name"], p["unit"] or "", str(p["default"]), p["valid"], p["description"]) for p in kind.parameters()
    ]
    if parameters:
        print_table("parameters (with: {...})", ("name", "unit", "default", "valid", "description"), parameters)
