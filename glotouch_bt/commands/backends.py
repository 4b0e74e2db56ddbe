"""`glotouch backends`: the installed backends. `glotouch keys`: keys for a driver on another computer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from glotouch_bt.commands.shared import Json, guarded, print_json


@guarded
def backends(json_: Json = False) -> None:
    """List the installed backends and whether they work here."""
    from glotouch_bt.commands.terminal import print_table
    from glotouch_bt.robot import BackendError, backend_entry_points, load_backend

    found: list[dict[str, Any]] = []
    for name in sorted(backend_entry_points()):
        try:
            found.append({"name": name, "usable": True, "summary": load_backend(name).summary})
        except BackendError as e:
            found.append({"name": name, "usable": False, "summary": str(e)})
    if json_:
        print_json(found)
    else:
        rows = [(b["name"], "yes" if b["usable"] else "no", b["summary"]) for b in found]
        print_table("backends", ("name", "usable", "description"), rows)


@guarded
def keys(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder that receives the keys")],
    client: Annotated[str, typer.Option(help="name of the client")] = "client",
) -> int:
    """Make the keys of a driver on another computer and of one client.

    DIR/driver is for the driver's computer, DIR/CLIENT for the client's. A second call with another --client adds one.
    """
    from glotouch_bt.commissioning import write_keys

    for path in write_keys(folder, client):
        print(path)
    return 0
