"""Load and check the STL files of the world's objects.

An object is a single watertight solid in metres, upright: its z axis is up and it stands on its lowest point.
"""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from os.path import isfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.errors import BadInput
from glotouch_bt.lazy import lazy_module
from glotouch_bt.robot.geometry import Array
from glotouch_bt.untrusted import read_file

if TYPE_CHECKING:
    import trimesh
else:
    trimesh = lazy_module("trimesh")

MAX_STL_BYTES = 64_000_000
"""Largest size of an STL file; a text of this size has about 200,000 triangles."""
MAX_TRIANGLES = 300_000
"""Largest number of triangles of an object. A scan with more shows less than a pad can feel: 1 mm2 each on 0.3 m2."""
MAX_SHELLS = 1000
"""Largest number of closed surfaces that make up an object."""
MAX_ROUNDS = 100
"""Rounds of label propagation, which halve the distances; more are given to the thorough check."""
KEPT_SOLIDS = 64
"""Number of solids kept in memory. Source: ours, twice the objects of a large set."""
SIZE_DECIMALS = 6
"""Decimals of a metre to which sizes are compared and shown, because files of 32 bit floats are no more exact."""
MIN_SIZE_M = 0.005
"""Least size of an object along any axis of its file."""
MAX_SIZE_M = 0.30
"""Largest size of an object along any axis of its file."""
MIN_VOLUME_M3 = 1e-7
"""Least volume of an object; less means that its faces lie upon each other."""
MERGE_DECIMALS = (8, 6, 5)
"""Decimals of a metre to which corners are rounded, in turn until the mesh is closed. Files of 32 bit floats
and exporters that scale miss by up to a micrometre."""
Faces = npt.NDArray[np.int64]
_UNITS_M = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}
"""Units in which files are exported by mistake, in metres."""


@dataclass(frozen=True)
class Mesh:
    """A checked solid.

    Attributes:
        name: File stem.
        vertices_m: (v, 3), shifted so that the lowest vertex is at z = 0 and the middle of the bounding box at
            x = y = 0 (to a whole micrometre), wherever the file has its origin.
        faces: (f, 3) vertex indices, outward by the right-hand rule.
        digest: SHA-256 of the geometry, not of the file; the key of every cache.
    """

    name: str
    vertices_m: Array
    faces: Faces
    digest: str

    @property
    def extents_m(self) -> Array:
        """(3,) size of the axis-aligned bounding box."""
        return np.asarray(np.ptp(self.vertices_m, axis=0), dtype=np.float64)

    def as_trimesh(self) -> trimesh.Trimesh:
        """Return the same solid as a trimesh object (unprocessed)."""
        return trimesh.Trimesh(self.vertices_m, self.faces, process=False)


_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> bytes:
    """Return the content of an STL file of bounded size.

    Raises:
        BadInput: It cannot be read or is too large.
    """
    return read_file(path, MAX_STL_BYTES, what="an STL file", links=True)


def triangles_of(data: bytes) -> npt.NDArray[np.void] | None:
    """Return the triangles of a binary STL, or None if it is none."""
    count = int.from_bytes(data[80:84], "little")
    return np.frombuffer(data, _FACET, offset=84) if len(data) == 84 + _FACET.itemsize * count else None


def sound_solid(data: bytes) -> tuple[Array, Faces] | None:
    """Return the corners and faces of a binary STL that is surely a solid: closed, in one piece, of a valid size.

    None leaves the verdict to `repaired_solid`, which gives the same for a sound one. This takes milliseconds and only
    numpy. Corners are numbered as they first occur. Those that are equal to `MERGE_DECIMALS[0]` are one.
    """
    triangles = triangles_of(data)
    if triangles is None or not 4 <= len(triangles) <= MAX_TRIANGLES:
        return None
    corners = triangles["corners"].astype(np.float64).reshape(-1, 3)
    if not np.isfinite(corners).all():
        return None
    size = np.ptp(corners, axis=0)
    if size.max() > MAX_SIZE_M or size.min() < MIN_SIZE_M:
        return None
    label = np.zeros(len(corners), np.int64)
    for column in (corners * 10 ** MERGE_DECIMALS[0]).round().astype(np.int64).T:
        values, rank = np.unique(column, return_inverse=True)  # far quicker than `unique` of rows
        label = np.unique(label * len(values) + rank, return_inverse=True)[1]
    first = np.unique(label, return_index=True)[1]
    order = first.argsort()
    start = order.argsort()[label].reshape(-1, 3)
    vertices = corners[first[order]]
    a, b, c = vertices[start.T]
    if np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 < 2.0 * MIN_VOLUME_M3:
        return None
    end = np.roll(start, -1, axis=1)
    forward = np.sort(start * label.size + end, axis=None)
    backward = np.sort(end * label.size + start, axis=None)
    if (start == end).any() or (forward[1:] == forward[:-1]).any():
        return None
    return (vertices, start) if np.array_equal(forward, backward) and _in_one_piece(start, end) else None


def _in_one_piece(start: npt.NDArray[np.intp], end: npt.NDArray[np.intp]) -> bool:
    """Return True if edges surely connect all vertices. Each takes the least label beside it until none changes."""
    label = np.arange(start.max() + 1)
    for _ in range(MAX_ROUNDS):
        before = label.copy()
        np.minimum.at(label, start.ravel(), before[end.ravel()])
        label = label[label]
        if np.array_equal(label, before):
            return not label.any()
    return False


_loaded: dict[tuple[Path, bytes], Mesh] = {}
"""Solids read before, by path and content: world and skills of a mission load the same files, 0.1 s each."""


def load_mesh(path: Path) -> Mesh:
    """Read one STL.

    Common faults of exporters that have one clear meaning are repaired: duplicate corners, collapsed triangles, faces
    with the wrong side outward. Shells that touch, overlap or enclose a hollow are one object.

    Raises:
        BadInput: There is no such file, or it is not an STL, not watertight, several bodies, or too large. The message
            names the file, the fault and the remedy.
    """
    if not isfile(path):
        raise BadInput(f"{path}: no such STL file")
    data = read_stl(path)
    key = path, hashlib.sha256(data).digest()
    if key not in _loaded:
        if len(_loaded) == KEPT_SOLIDS:
            _loaded.pop(next(iter(_loaded)))
        _loaded[key] = solid_of(path, data)
    return _loaded[key]


def solid_of(path: Path, data: bytes) -> Mesh:
    """Return the solid in the content of an STL file; errors as for `load_mesh`, under the name `path`."""
    found, faces = sound_solid(data) or repaired_solid(path, data)
    vertices = np.array(found, dtype=np.float64)
    vertices[:, :2] -= np.round(0.5 * (vertices[:, :2].min(axis=0) + vertices[:, :2].max(axis=0)), 6)
    vertices[:, 2] -= vertices[:, 2].min()
    faces = np.array(faces, dtype=np.int64)
    digest = hashlib.sha256(vertices.round(9).tobytes() + faces.tobytes()).hexdigest()
    vertices.setflags(write=False)
    faces.setflags(write=False)
    return Mesh(path.stem, vertices, faces, digest)


def repaired_solid(path: Path, data: bytes) -> tuple[Array, Faces]:
    """Return the corners and faces of an STL file that may need repair; errors as for `load_mesh`."""
    data = bounded_stl(path, data)
    try:
        mesh = trimesh.load_mesh(io.BytesIO(data), file_type="stl", process=True)
    except Exception as e:  # trimesh raises many kinds on a broken file; their texts may quote it
        raise BadInput(f"{path}: {UNREADABLE}") from e
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) < 4:
        raise BadInput(f"{path}: holds no solid (fewer than 4 triangles)")
    if not np.isfinite(mesh.vertices).all():
        raise BadInput(f"{path}: has vertices that are not finite numbers")
    _require_size(path, mesh)
    _close(path, mesh)
    _orient(path, mesh)
    _require_one_body(path, mesh)
    return mesh.vertices, mesh.faces


UNREADABLE = "is not a readable STL file; export it again as a binary STL"


def bounded_stl(path: Path, data: bytes) -> bytes:
    """Return a file of bounded length as a reader may take it: a binary STL as it is, a text without odd characters.

    Raises:
        BadInput: It has too many triangles, or is neither a binary STL nor a text.
    """
    triangles = triangles_of(data)
    if triangles is not None:
        count = len(triangles)
    else:
        words = data.lower()
        if b"endsolid" not in words:
            raise BadInput(f"{path}: {UNREADABLE}")
        count = words.count(b"vertex") // 3
        data = data.decode("ascii", "replace").encode()
    if count > MAX_TRIANGLES:
        raise BadInput(
            f"{path}: has {count} triangles; at most {MAX_TRIANGLES} are allowed: simplify it in a mesh editor"
        )
    return data


def _require_size(path: Path, mesh: trimesh.Trimesh) -> None:
    thickness, largest = (round(float(size), SIZE_DECIMALS) for size in (mesh.extents.min(), mesh.extents.max()))
    if largest > MAX_SIZE_M:
        fitting = {u: f for u, f in _UNITS_M.items() if thickness * f >= MIN_SIZE_M and largest * f <= MAX_SIZE_M}
        hint = "; ".join(f"in {u}? then scale it by {f:g} to {largest * f:.3g} m" for u, f in fitting.items())
        raise BadInput(
            f"{path}: is {largest:.7g} m large; STL files must be in METRES and at most {MAX_SIZE_M} m"
            + (f" ({hint})" if hint else "")
        )
    if thickness < MIN_SIZE_M:
        raise BadInput(f"{path}: is only {thickness:.6g} m thick; at least {MIN_SIZE_M} m is needed")


def _close(path: Path, mesh: trimesh.Trimesh) -> None:
    """Join duplicate corners, with the tolerances of `MERGE_DECIMALS` in turn, until no edge is open."""
    for decimals in MERGE_DECIMALS:
        mesh.merge_vertices(digits_vertex=decimals)
        a, b, c = mesh.faces.T
        mesh.update_faces((a != b) & (b != c) & (c != a))
        if mesh.is_watertight:
            return
    raise BadInput(f"{path}: is not watertight (open edges); close its holes in a mesh editor and export it again")


def _orient(path: Path, mesh: trimesh.Trimesh) -> None:
    """Turn every face outwards.

    Neighbours agree if they traverse their common edge in opposite directions. Build a graph with two nodes for each
    face, as it is and turned over. The nodes that agree form two mirrored components for each shell; choose one.
    """
    if not mesh.is_winding_consistent:
        n = len(mesh.faces)
        pairs, edges = mesh.face_adjacency, mesh.face_adjacency_edges
        first, second = (_runs_forward(mesh.faces[pairs[:, i]], edges) for i in (0, 1))
        turn = n * (first == second)
        rows = np.concatenate([pairs[:, 0], pairs[:, 0] + n])
        columns = np.concatenate([pairs[:, 1] + turn, pairs[:, 1] + n - turn])
        graph = scipy.sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(2 * n, 2 * n))
        label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        if (label[:n] == label[n:]).any():
            raise BadInput(f"{path}: has no inside (a one-sided surface); make it a solid in a mesh editor")
        over = label[:n] > label[n:]
        faces = mesh.faces.copy()
        faces[over] = faces[over][:, ::-1]
        mesh.faces = faces
    if mesh.volume < 0:
        mesh.invert()
    if mesh.volume < MIN_VOLUME_M3:
        raise BadInput(f"{path}: encloses no volume; its faces lie upon each other")


def _runs_forward(faces: Faces, edges: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Return (k,) True where face i (k, 3) traverses its edge i (k, 2) in the direction of the edge."""
    following = np.roll(faces, -1, axis=1)
    return np.asarray(((faces == edges[:, :1]) & (following == edges[:, 1:])).any(axis=1))


def _require_one_body(path: Path, mesh: trimesh.Trimesh) -> None:
    """Count shells whose bounding boxes overlap as one object."""
    if mesh.body_count == 1:
        return
    label = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(mesh.faces))
    shells = int(label.max()) + 1
    if shells > MAX_SHELLS:
        raise BadInput(f"{path}: holds {shells} separate bodies; one object per file")
    low, high = np.full((shells, 3), np.inf), np.full((shells, 3), -np.inf)
    np.minimum.at(low, label, mesh.triangles.min(axis=1))
    np.maximum.at(high, label, mesh.triangles.max(axis=1))
    rows, columns = np.nonzero((low[:, None] <= high[None]).all(axis=2) & (high[:, None] >= low[None]).all(axis=2))
    graph = scipy.sparse.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(low), len(low)))
    count = int(scipy.sparse.csgraph.connected_components(graph, directed=False)[0])
    if count > 1:
        raise BadInput(f"{path}: holds {count} separate bodies; one object per file")
