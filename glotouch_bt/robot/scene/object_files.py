"""The STL files of a folder of objects: their names, the solids in them, and those that have the same shape."""

from __future__ import annotations

import hashlib
from os.path import isdir
from pathlib import Path

from glotouch_bt.errors import BadInput
from glotouch_bt.escaped_text import fault_of_name
from glotouch_bt.robot.scene.meshes import Mesh, load_mesh, read_stl, triangles_of
from glotouch_bt.robot.scene.world import ObjectSet

MESH_SUFFIXES = (".obj", ".ply", ".glb", ".off")
"""Formats of meshes besides STL that `glotouch objects` reads."""


def stl_files(folder: Path) -> dict[str, Path]:
    """Return the STL files of a folder by the name of their object, sorted.

    Raises:
        BadInput: There is no such folder, two files have the same name of an object, or a name has control characters.
    """
    if not isdir(folder):
        raise BadInput(f"{folder}: no such folder of STL files")
    files: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() != ".stl":
            continue
        if fault := fault_of_name(path.stem):
            raise BadInput(f"{folder}: the name of {path.name!r} {fault}; rename the file")
        if path.stem in files:
            both = f"{files[path.stem].name} and {path.name}"
            raise BadInput(f"{folder}: {both} are two files for one object; rename one of them")
        files[path.stem] = path
    return files


def load_folder(folder: Path, names: tuple[str, ...] = ()) -> list[Mesh]:
    """Load every STL of a folder, sorted by name, or the named files in order.

    Raises:
        BadInput: The folder is missing or empty, a name is not in it, or a file is unusable.
    """
    files = stl_files(folder)
    if not files:
        raise BadInput(f"{folder}: holds no .stl file")
    missing = [n for n in names if n not in files]
    if missing:
        raise BadInput(f"{folder}: has no {', '.join(missing)} (it has {', '.join(files)})")
    return [load_mesh(files[n]) for n in (names or tuple(files))]


def twins_of(target: str, objects: ObjectSet) -> tuple[str, ...]:
    """Return the objects whose files have the same triangles as the target, which touch cannot tell from it.

    Args:
        target: Name of an object of the set, or the path of an STL file.
        objects: The objects in the container.

    Raises:
        BadInput: A file cannot be read.
    """
    if not isdir(objects.folder):
        return ()
    files = stl_files(objects.folder)
    path = Path(target) if target.lower().endswith(".stl") else files[target]
    shape = _shape(path)
    same = [n for n in objects.names or files if _shape(files[n]) == shape]
    return tuple(n for n in same if n != path.stem) if len(same) > 1 else ()


def _shape(path: Path) -> str:
    """Return a digest of the corners of a binary STL, or of the words of another one."""
    data = read_stl(path)
    triangles = triangles_of(data)
    if triangles is None:
        return hashlib.sha256(b" ".join(data.lower().split()[2:])).hexdigest()
    return hashlib.sha256(triangles["corners"].tobytes()).hexdigest()
