"""STL files as the world's objects: loaded, checked, and named by what is in them.

An object is a single watertight solid in metres, upright: its z axis is up and it stands on its lowest point.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from glotouch_bt.robot.errors import BadInput
from glotouch_bt.robot.geometry import Array

SMALLEST_M, LARGEST_M = 0.005, 0.30


@dataclass(frozen=True)
class Mesh:
    """A checked solid.

    Attributes:
        name: File stem.
        vertices_m: (v, 3), shifted so that the lowest vertex is at z = 0; x and y as in the file.
        faces: (f, 3) vertex indices, outward by the right-hand rule.
        digest: SHA-256 of the geometry (not of the file's bytes); the key of every cache.
    """

    name: str
    vertices_m: Array
    faces: npt.NDArray[np.int64]
    digest: str

    @property
    def extents_m(self) -> Array:
        """(3,) size of the axis-aligned bounding box."""
        return np.asarray(np.ptp(self.vertices_m, axis=0), dtype=np.float64)

    def as_trimesh(self) -> trimesh.Trimesh:
        """The same solid as a trimesh object (unprocessed)."""
        return trimesh.Trimesh(self.vertices_m, self.faces, process=False)


def load_mesh(path: Path) -> Mesh:
    """Read one STL.

    Raises:
        BadInput: No such file, not an STL, not watertight, several bodies, or a size that cannot be metres. The message
            names the file, what is wrong and what to do.
    """
    if not path.is_file():
        raise BadInput(f"{path}: no such STL file")
    try:
        mesh = trimesh.load_mesh(path, file_type="stl", process=True)
    except Exception as e:  # trimesh raises many kinds on a broken file
        raise BadInput(f"{path}: not a readable STL ({e})") from e
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) < 4:
        raise BadInput(f"{path}: holds no solid (fewer than 4 triangles)")
    if not np.isfinite(mesh.vertices).all():
        raise BadInput(f"{path}: has vertices that are not finite numbers")
    if not mesh.is_watertight:
        raise BadInput(f"{path}: is not watertight (open edges); close its holes in a mesh editor and export it again")
    largest = float(mesh.extents.max())
    if largest > LARGEST_M:
        raise BadInput(
            f"{path}: is {largest:.3g} m large; STL files must be in METRES and at most {LARGEST_M} m"
            + (f" (in millimetres? then scale it by 0.001 to {largest * 1e-3:.3g} m)" if largest > 1.0 else "")
        )
    if float(mesh.extents.min()) < SMALLEST_M:
        raise BadInput(f"{path}: is only {float(mesh.extents.min()):.3g} m thick; at least {SMALLEST_M} m is needed")
    if mesh.body_count != 1:
        raise BadInput(f"{path}: holds {mesh.body_count} separate bodies; one object per file")
    if mesh.volume < 0:
        mesh.invert()
    vertices = np.array(mesh.vertices, dtype=np.float64)
    vertices[:, 2] -= vertices[:, 2].min()
    faces = np.array(mesh.faces, dtype=np.int64)
    digest = hashlib.sha256(vertices.round(9).tobytes() + faces.tobytes()).hexdigest()
    vertices.setflags(write=False)
    faces.setflags(write=False)
    return Mesh(path.stem, vertices, faces, digest)


def load_folder(folder: Path, names: tuple[str, ...] = ()) -> list[Mesh]:
    """Every STL of a folder sorted by name, or the named ones in order.

    Raises:
        BadInput: The folder is missing or empty, a name is not in it, or a file is unusable.
    """
    if not folder.is_dir():
        raise BadInput(f"{folder}: no such folder of STL files")
    files = {p.stem: p for p in sorted(folder.iterdir()) if p.suffix.lower() == ".stl"}
    if not files:
        raise BadInput(f"{folder}: holds no .stl file")
    missing = [n for n in names if n not in files]
    if missing:
        raise BadInput(f"{folder}: has no {', '.join(missing)} (it has {', '.join(files)})")
    return [load_mesh(files[n]) for n in (names or tuple(files))]
