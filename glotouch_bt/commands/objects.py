"""`glotouch objects`: look at a folder of meshes, and make clean objects of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from glotouch_bt.commands import shared


@shared.guarded
def objects(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="folder of STL, OBJ, PLY, GLB or OFF files, or one file")
    ],
    units: Annotated[str | None, typer.Option(help="unit of the files: m, cm, mm or inch (default: m)")] = None,
    side: Annotated[
        list[str] | None,
        typer.Option("--side", metavar="NAME=N", help="stand an object on its side N instead"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="write clean STL files and objects.html there")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the clean folder that --out holds")] = False,
    backend: shared.Backend = "mujoco",
    json_: shared.Json = False,
) -> int:
    """Show and repair your own objects.

    Shows each object's size, weight, sides to stand on, fit between the jaws and look-alikes. With --out, writes
    watertight, upright STL files in metres, and a page with pictures. A file that is no solid is refused.
    """
    from glotouch_bt import objects as library
    from glotouch_bt.commands.terminal import print_objects
    from glotouch_bt.robot import UnknownName, load_backend

    if units is not None and units not in library.UNITS_M:
        raise UnknownName("unit", units, library.UNITS_M)
    files = library.mesh_files(folder)
    sides = library.chosen_sides(shared.read_settings(side, "--side"), files)
    if out is not None:
        library.check_free(out, folder, overwrite)
    description = load_backend(backend).description
    gripper = None if description is None else description.gripper
    show = shared.progress(lambda path: path.name)
    results = []
    for number, (name, path) in enumerate(files.items(), start=1):
        if not json_:
            show(path, number, len(files))
        results.append(library.prepare(path, units, sides.get(name), gripper))
    good = [r for r in results if isinstance(r, library.Prepared)]
    alike = library.look_alikes([r.model for r in good if r.model is not None])
    if out is not None and good:
        library.write_clean(out, good, library.page(f"Objects of {folder}", results, alike))
    if json_:
        pairs = [{"objects": [a.first, a.second], "closures": a.closures} for a in alike]
        shared.print_json({"objects": [r.as_dict() for r in results], "look_alikes": pairs})
    else:
        print_objects(folder, results, alike, out if good else None)
    return 0 if len(good) == len(results) else 2
