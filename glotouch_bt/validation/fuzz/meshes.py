"""Objects: STL files made and corrupted at random, loaded alone and as the objects of a mission."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.read import load_world
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import Mesh, draw_layout, load_mesh, repaired_solid, sound_solid, stl_files
from glotouch_bt.validation.fuzz.corrupt import corrupt_bytes
from glotouch_bt.validation.fuzz.documents import pick
from glotouch_bt.validation.fuzz.kind import Class, FuzzKind, refused

Rng = np.random.Generator
Triangles = npt.NDArray[np.float32]
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
WORLD = "container_five"
NAMES = ("a", "b", "a.b", "ä", "a b", "x" * 200, "-", "a\x1b[31m", "a\nb", "\u202egpj", "[bold]", "<b>", "$n")
ODD_NUMBERS = (np.nan, np.inf, -np.inf, 3e38, 1e-45, 0.0, -0.0, 1e9, 0.1)
MISSION = "mission: m\nworld: worlds/container_five.yaml\nparameters: {target: {type: stl}}\n"
MISSION += "tree: [tool_pickup, {match: {target: $target}}]\n"


class MeshKind(FuzzKind):
    """One or two STL files in a folder."""

    name = "meshes"
    description = "STL files, loaded alone and as the objects of a mission"

    def prepare(self, folder: Path) -> None:
        """Write the mission, and import what loads meshes."""
        (folder / "m.yaml").write_text(MISSION)
        load_mesh(next(iter(stl_files(load_world(WORLD).objects.folder).values())))

    def make(self, rng: Rng, folder: Path) -> str:
        """See `FuzzKind`."""
        objects = folder / "objects"
        objects.mkdir(exist_ok=True)
        for old in objects.iterdir():
            old.unlink()
        for _ in range(2 if rng.random() < 0.2 else 1):
            data = _as_file(_damaged(_solid(rng), rng), rng)
            if rng.random() < 0.5:
                data = _corrupted(data, rng)
            name = pick(rng, NAMES) if rng.random() < 0.15 else "a"
            (objects / f"{name}{pick(rng, ('.stl', '.stl', '.stl', '.STL'))}").write_bytes(data)
        return "mesh"

    def attempt(self, sort: str, folder: Path, rng: Rng) -> tuple[Class, str]:
        """See `FuzzKind`."""
        objects = folder / "objects"
        meshes: list[Mesh] = []
        refusal: BadInput | None = None
        for path in sorted(objects.iterdir()):
            if fault := _fault_of_quick_reading(path):
                return "accepted wrongly", fault
            try:
                meshes.append(load_mesh(path))
            except BadInput as e:
                refusal = e
        for mesh in meshes:
            if not (np.isfinite(mesh.vertices_m).all() and mesh.as_trimesh().is_watertight):
                return "accepted wrongly", f"{mesh.name!r} is no solid"
        try:
            load_mission("m.yaml", {"target": pick(rng, ("a", "objects/a.stl"))}, objects=Path("objects"))
            draw_layout(meshes, load_world(WORLD), int(rng.integers(100)))
        except BadInput as e:
            return refused(e)
        return refused(refusal) if refusal is not None else ("accepted", "")


def _fault_of_quick_reading(path: Path) -> str:
    """Return how the quick reading of an STL file differs from the thorough one, or empty."""
    data = path.read_bytes()
    quick = sound_solid(data)
    if quick is None:
        return ""
    try:
        same = all(map(np.array_equal, quick, repaired_solid(path, data)))
    except BadInput as e:
        return f"{path.name!r} counts as sound, but: {e}"
    return "" if same else f"{path.name!r} is not read as trimesh reads it"


@lru_cache(maxsize=1)
def _shipped() -> tuple[Triangles, ...]:
    """Return the shipped objects as triangles (n, 3, 3)."""
    solids = (load_mesh(p) for p in stl_files(load_world(WORLD).objects.folder).values())
    return tuple(np.asarray(s.vertices_m[s.faces], dtype=np.float32) for s in solids)


def _solid(rng: Rng) -> Triangles:
    """Return a block, a ring of blocks, a sphere-like solid, or a shipped object."""
    shape = rng.random()
    if shape < 0.1:
        return pick(rng, _shipped()).copy()
    if shape < 0.4:
        return _lattice(int(rng.integers(3, 24)), int(rng.integers(3, 24)), rng)
    blocks = [_block(rng) + rng.normal(0.0, 0.02, 3).astype(np.float32) for _ in range(int(rng.integers(1, 4)))]
    return np.concatenate(blocks)


def _block(rng: Rng) -> Triangles:
    size = rng.uniform(0.004, 0.09, 3)
    corner = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * size
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
             [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
    return np.asarray(corner[np.array(faces)], dtype=np.float32)


def _lattice(around: int, up: int, rng: Rng) -> Triangles:
    """Return a closed solid of revolution with random radii, as rings of triangles between two poles."""
    radius = rng.uniform(0.005, 0.06, up)
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    height = np.linspace(0.0, rng.uniform(0.005, 0.1), up + 2)
    rings = np.array(
        [[(r * np.cos(a), r * np.sin(a), z) for a in angle] for r, z in zip(radius, height[1:], strict=False)]
    )
    made = []
    for i in range(around):
        j = (i + 1) % around
        made.append([(0.0, 0.0, height[0]), rings[0, j], rings[0, i]])
        made.append([(0.0, 0.0, height[-1]), rings[-1, i], rings[-1, j]])
        for k in range(up - 1):
            made.append([rings[k, i], rings[k, j], rings[k + 1, j]])
            made.append([rings[k, i], rings[k + 1, j], rings[k + 1, i]])
    return np.array(made, dtype=np.float32)


def _damaged(solid: Triangles, rng: Rng) -> Triangles:
    for _ in range(int(rng.integers(0, 3))):
        solid = pick(rng, _DAMAGES)(solid, rng)
    return solid


def _scale(solid: Triangles, rng: Rng) -> Triangles:
    with np.errstate(over="ignore"):
        return solid * np.float32(pick(rng, (1000.0, 100.0, 25.4, 1e-3, -1.0, 0.0, 1e30, 1.5)))


def _drop(solid: Triangles, rng: Rng) -> Triangles:
    return solid[rng.random(len(solid)) < pick(rng, (0.0, 0.5, 0.9, 0.99))]


def _turn_over(solid: Triangles, rng: Rng) -> Triangles:
    over = rng.random(len(solid)) < pick(rng, (0.1, 0.5, 1.0))
    solid[over] = solid[over][:, ::-1]
    return solid


def _shake(solid: Triangles, rng: Rng) -> Triangles:
    return np.asarray(solid + rng.normal(0.0, pick(rng, (1e-9, 1e-7, 1e-6, 1e-3)), solid.shape), dtype=np.float32)


def _repeat(solid: Triangles, rng: Rng) -> Triangles:
    return np.concatenate([solid] * int(pick(rng, (2, 3, 50))))[:200_000]


def _odd_corner(solid: Triangles, rng: Rng) -> Triangles:
    if solid.size:
        flat = solid.reshape(-1)
        flat[rng.integers(flat.size, size=int(rng.integers(1, 5)))] = pick(rng, ODD_NUMBERS)
    return solid


def _collapse(solid: Triangles, rng: Rng) -> Triangles:
    solid[..., int(rng.integers(3))] *= np.float32(pick(rng, (0.0, 1e-3, 1e-6)))
    return solid


_DAMAGES: tuple[Callable[[Triangles, Rng], Triangles], ...] = (
    _scale, _drop, _turn_over, _shake, _repeat, _odd_corner, _collapse,
)  # fmt: skip


def _as_file(solid: Triangles, rng: Rng) -> bytes:
    """Return the triangles as a binary or a text STL."""
    if rng.random() < 0.3 and len(solid) < 2000:
        lines = [f"facet normal 0 0 0\nouter loop\n{_vertices(t)}endloop\nendfacet\n" for t in solid]
        return f"solid {pick(rng, NAMES)}\n{''.join(lines)}endsolid\n".encode()
    table = np.zeros(len(solid), FACET)
    table["corners"] = solid
    count = len(solid)
    if rng.random() < 0.15:
        count = int(pick(rng, (0, 1, count + 1, max(count - 1, 0), 5_000_000, 2**31, 2**32 - 1)))
    head = pick(rng, (b"", b"solid", b"solid x\nfacet normal", b"\xff" * 80)).ljust(80, pick(rng, (b" ", b"\0")))[:80]
    return head + count.to_bytes(4, "little") + table.tobytes()


def _vertices(triangle: Triangles) -> str:
    return "".join(f"vertex {x:.6g} {y:.6g} {z:.6g}\n" for x, y, z in triangle.tolist())


def _corrupted(data: bytes, rng: Rng) -> bytes:
    how = rng.random()
    if how < 0.5:
        return corrupt_bytes(data, rng)
    if how < 0.7:
        return data[: int(rng.integers(len(data) + 1))]
    if how < 0.9:
        return data + rng.bytes(int(rng.integers(1, 200)))
    return bytes(rng.bytes(int(rng.integers(0, 2000))))
