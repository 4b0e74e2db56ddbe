"""`glotouch backends`: the installed backends."""

from __future__ import annotations

from typing import Any

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
