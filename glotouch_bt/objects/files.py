"""Read a mesh file of any of five formats, of bounded size, in metres and with z up."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os.path import isdir, isfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh

from glotouch_bt.errors import BadInput
from glotouch_bt.escaped_text import fault_of_name
from glotouch_bt.robot import Array
from glotouch_bt.robot.scene import (
    MAX_SIZE_M,
    MAX_STL_BYTES,
    MAX_TRIANGLES,
    MESH_SUFFIXES,
    MIN_SIZE_M,
    bounded_stl,
)
from glotouch_bt.untrusted import parse_json, read_file

UNITS_M: Mapping[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}
"""Units that a file may be in, in metres."""
MAX_GLB_VALUES = 50 * MAX_TRIANGLES
"""Largest number of elements that a GLB may declare; a reader fills what it declares with zeros. Source: ours."""
Y_UP = (".glb",)
"""Formats whose y axis is up. Source: glTF 2.0 specification, 3.4 (also: units are metres)."""


class ImplausibleSize(BadInput):
    """A file measures too little or too much in its unit.

    Args:
        message: What is wrong.
        fitting: Units in which its size is plausible.
    """

    def __init__(self, message: str, fitting: Sequence[str]) -> None:
        super().__init__(message)
        self.fitting = tuple(fitting)


@dataclass(frozen=True)
class RawMesh:
    """Triangles as a file has them, in metres, z up.

    Attributes:
        vertices_m: (v, 3) finite.
        faces: (f, 3).
        notes: What was converted, for a person.
    """

    vertices_m: Array
    faces: npt.NDArray[np.int64]
    notes: tuple[str, ...] = ()


def mesh_files(given: Path) -> dict[str, Path]:
    """Return the mesh files of a folder by the name of their object, sorted; of a file, that file.

    Raises:
        BadInput: There is no such folder, no mesh in it, or two files are one object.
    """
    suffixes = (".stl", *MESH_SUFFIXES)
    if not isdir(given) and not isfile(given):
        raise BadInput(f"{given}: no such folder or file")
    paths = sorted(given.iterdir()) if isdir(given) else [given]
    files: dict[str, Path] = {}
    for path in paths:
        if path.suffix.lower() not in suffixes or isdir(path):
            continue
        if fault := fault_of_name(path.stem):
            raise BadInput(f"{given}: the name of {path.name!r} {fault}; rename the file")
        if path.stem in files:
            raise BadInput(f"{given}: {files[path.stem].name} and {path.name} are two files for one object; rename one")
        files[path.stem] = path
    if not files:
        raise BadInput(f"{given}: holds no mesh (formats: {', '.join(suffixes)})")
    return files


def read_mesh(path: Path, unit: str | None) -> RawMesh:
    """Read one file.

    Args:
        path: The file; its suffix names the format.
        unit: Unit of its numbers, a key of `UNITS_M`; None: metres.

    Raises:
        BadInput: It is no readable mesh, or of no plausible size. The message has the remedy.
    """
    kind = path.suffix.lower().removeprefix(".")
    data = read_file(path, MAX_STL_BYTES, what="a mesh file", links=True)
    if kind == "stl":
        data = bounded_stl(path, data)
    elif kind == "glb":
        _require_bounded_glb(path, data)
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False)
        solids = {name: g for name, g in scene.geometry.items() if isinstance(g, trimesh.Trimesh) and len(g.faces)}
        copies = [(scene.graph[node][0], solids[scene.graph[node][1]]) for node in scene.graph.nodes_geometry
                  if scene.graph[node][1] in solids]  # fmt: skip
        count = sum(len(solid.faces) for _, solid in copies)
        if count > MAX_TRIANGLES:
            raise BadInput(
                f"{path}: has {count} triangles; at most {MAX_TRIANGLES} are allowed: simplify it in a mesh editor"
            )
        vertices, faces = _joined(copies)
    except BadInput:
        raise
    except Exception as e:  # trimesh raises many kinds on a broken file; their texts may quote it
        said = f"{path}: is not a readable {kind.upper()} file; export it again, as a binary STL for instance"
        raise BadInput(said) from e
    if len(faces) < 4:
        raise BadInput(f"{path}: holds no solid ({_emptiness(scene, len(faces))})")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise BadInput(f"{path}: its triangles name corners that do not exist; export it again")
    if not np.isfinite(vertices[faces]).all():
        raise BadInput(f"{path}: has vertices that are not finite numbers; export it again")
    notes = []
    if path.suffix.lower() in Y_UP:
        vertices = vertices @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
        notes.append("turned from y up to z up, as the format says")
    if len(copies) > 1:
        notes.append(f"joined {len(copies)} parts")
    return RawMesh(_in_metres(path, vertices, faces, unit, notes), faces, tuple(notes))


def _emptiness(scene: trimesh.Scene, triangles: int) -> str:
    """Return why a scene holds no solid."""
    if triangles:
        return "fewer than 4 triangles"
    return "points or lines only" if any(len(g.vertices) for g in scene.geometry.values()) else "nothing"


def _joined(copies: list[tuple[Any, trimesh.Trimesh]]) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return the vertices (v, 3) and faces (f, 3) of meshes at their places (4 x 4 matrices)."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for matrix, solid in copies:
        corners = np.asarray(solid.vertices, dtype=np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            vertices.append(corners @ np.asarray(matrix)[:3, :3].T + np.asarray(matrix)[:3, 3])
        faces.append(np.asarray(solid.faces, dtype=np.int64) + count)
        count += len(corners)
    return np.concatenate(vertices), np.concatenate(faces)


def _require_bounded_glb(path: Path, data: bytes) -> None:
    """Refuse a binary glTF that declares more than it can hold. Its first chunk is JSON: glTF 2.0, 4.4."""
    length = int.from_bytes(data[12:16], "little")
    if data[:4] != b"glTF" or data[16:20] != b"JSON" or length > len(data):
        raise BadInput(f"{path}: is not a readable GLB file; export it again as binary glTF 2.0")
    header = parse_json(data[20 : 20 + length], str(path))
    accessors = header.get("accessors", []) if isinstance(header, dict) else []
    counts = [a.get("count", 0) if isinstance(a, dict) else 0 for a in accessors if accessors]
    if not all(isinstance(n, int) and n >= 0 for n in counts) or sum(counts) > MAX_GLB_VALUES:
        raise BadInput(f"{path}: declares more than {MAX_GLB_VALUES} numbers; simplify it in a mesh editor")


def _in_metres(path: Path, vertices: Array, faces: npt.NDArray[np.int64], unit: str | None, notes: list[str]) -> Array:
    """Return the vertices in metres.

    Raises:
        BadInput: The size is implausible in this unit; the message says which unit would fit.
    """
    size = np.ptp(vertices[faces].reshape(-1, 3), axis=0)
    if _plausible(size * UNITS_M[unit or "m"]):
        if unit not in (None, "m"):
            notes.append(f"converted from {unit}")
        return np.asarray(vertices * UNITS_M[unit or "m"])
    fitting = [u for u, factor in UNITS_M.items() if _plausible(size * factor)]
    shown = " x ".join(f"{s:.4g}" for s in size)
    hint = "".join(f"; in {u} it is {_millimetres(size * UNITS_M[u])}: give --units {u}" for u in fitting)
    raise ImplausibleSize(
        f"{path}: measures {shown} {unit or 'm'}; objects have {MIN_SIZE_M * 1e3:g} to {MAX_SIZE_M * 1e3:g} mm along "
        f"every axis{hint}",
        fitting,
    )


def _plausible(size_m: Array) -> bool:
    rounded = np.round(size_m, 6)  # files of 32 bit floats are no more exact
    return bool(rounded.min() >= MIN_SIZE_M and rounded.max() <= MAX_SIZE_M)


def _millimetres(size_m: Array) -> str:
    return " x ".join(f"{s * 1e3:.4g}" for s in size_m) + " mm"
