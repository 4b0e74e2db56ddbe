"""`glotouch keys`: keys for a driver on another computer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands.shared import guarded


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
