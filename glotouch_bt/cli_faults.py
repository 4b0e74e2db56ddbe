"""`glotouch faults`: what can be made to go wrong, and how a plan asks for it."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from glotouch_bt.guarded import guarded


@guarded
def faults(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="one fault")] = None,
    json_: Annotated[bool, typer.Option("--json", help="print JSON on stdout, nothing else")] = False,
) -> None:
    """List the faults a plan may ask for (glotouch run --faults FILE), or describe one."""
    from glotouch_bt import console
    from glotouch_bt.faults.catalogue import CATALOGUE
    from glotouch_bt.mission.library import shipped
    from glotouch_bt.robot import UnknownName

    if name is not None and name not in CATALOGUE:
        raise UnknownName("fault", name, CATALOGUE)
    kinds = [CATALOGUE[name]] if name else list(CATALOGUE.values())
    if json_:
        described = [k.as_dict() for k in kinds]
        sys.stdout.write(json.dumps(described[0] if name else described, indent=2) + "\n")
        return
    if name is None:
        rows = [(k.name, k.channel, "yes" if k.recoverable else "no", k.summary, k.seen_by) for k in kinds]
        console.print_table("faults", ("name", "channel", "recoverable", "what it does", "who should see it"), rows)
        sys.stdout.write(f"shipped plans: {', '.join(shipped('faults')) or 'none'}\n")
        return
    kind = kinds[0]
    where = " (simulation only)" if kind.channel == "world" else ""
    sys.stdout.write(f"{kind.name}: {kind.summary}{where}\n")
    sys.stdout.write(f"channel {kind.channel}; seen by {kind.seen_by}; ")
    sys.stdout.write(f"{'recoverable' if kind.recoverable else 'ends the mission'}\n")
    rows5 = [(p["name"], p["unit"] or "", str(p["default"]), p["valid"], p["description"]) for p in kind.parameters()]
    if rows5:
        console.print_table("parameters (with: {...})", ("name", "unit", "default", "valid", "what it is"), rows5)
