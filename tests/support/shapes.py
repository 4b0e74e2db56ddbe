"""Objects that are not shipped, made by formula: `python tests/shapes.py DIR --set easy|duplicates|hard|all`.

Sets of watertight solids of 4-11 cm in metres, upright, by which tests and benches try that nothing leans on the
shipped five. `easy` is five everyday shapes; `duplicates` is five of which two differ by a waist of 2.5 mm only, for
recognition; `hard` has what a loader, a cutter, a prober or a gripper may stumble on:
thin, flat, tall, overhanging, star-shaped, finely tessellated, off its file's origin, wider than the jaws open.
Deterministic; every mesh is built face by face from numpy alone.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

Array = npt.NDArray[np.float64]
MM = 1e-3


def _grid_faces(rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Triangles of a (rows, columns) grid of vertices, numbered row by row, that closes on itself along columns."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    return np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])


def loft(rings: Array) -> trimesh.Trimesh:
    """A solid through rings of points, its ends closed by fans about their means.

    Args:
        rings: (rows, columns, 3), anticlockwise seen from above, bottom first; an end ring is seen whole from its mean.
    """
    rows, columns, _ = rings.shape
    vertices = np.concatenate([rings.reshape(-1, 3), rings[:1].mean(axis=1), rings[-1:].mean(axis=1)])
    bottom, top = rows * columns, rows * columns + 1
    j = np.arange(columns)
    k = (j + 1) % columns
    last = (rows - 1) * columns
    caps = [np.stack([np.full(columns, bottom), k, j], -1), np.stack([np.full(columns, top), last + j, last + k], -1)]
    return trimesh.Trimesh(vertices, np.concatenate([_grid_faces(rows, columns), *caps]), process=False)


def lathe(profile_mm: Sequence[tuple[float, float]], columns: int = 64) -> trimesh.Trimesh:
    """A body of revolution: (radius, height) from the bottom's rim along the outside to the top's rim, or on down
    inside a hollow to its floor's rim."""
    r, z = np.array(profile_mm).T * MM
    a = np.linspace(0.0, 2 * np.pi, columns, endpoint=False)
    rings = np.stack(
        [r[:, None] * np.cos(a), r[:, None] * np.sin(a), np.broadcast_to(z[:, None], (len(z), columns))], -1
    )
    return loft(rings)


def prism(outline_mm: Array, height_mm: float, top_scale: float = 1.0) -> trimesh.Trimesh:
    """An upright prism (or frustum) over an outline (n, 2), anticlockwise, seen whole from the mean of its points."""
    flat = np.asarray(outline_mm, dtype=np.float64)
    top = flat.mean(axis=0) + top_scale * (flat - flat.mean(axis=0))
    rings = np.stack([np.column_stack([p, np.full(len(p), z)]) for p, z in ((flat, 0.0), (top, height_mm))])
    return loft(rings * MM)


def block(x_mm: float, y_mm: float, z_mm: float) -> trimesh.Trimesh:
    """An upright box."""
    return prism(0.5 * np.array([x_mm, y_mm]) * [[1, 1], [-1, 1], [-1, -1], [1, -1]], z_mm)


def polygon(sides: int, radius_mm: float, inner_mm: float | None = None) -> Array:
    """Corners (n, 2) of a regular polygon, or of a star with `sides` tips whose notches reach in to `inner_mm`."""
    n = sides if inner_mm is None else 2 * sides
    a = 2 * np.pi * np.arange(n) / n
    r = np.full(n, radius_mm) if inner_mm is None else np.where(np.arange(n) % 2 == 0, radius_mm, inner_mm)
    return np.column_stack([r * np.cos(a), r * np.sin(a)])


def _moved(mesh: trimesh.Trimesh, *shift_m: float) -> trimesh.Trimesh:
    mesh.apply_translation(shift_m)
    return mesh


def cup() -> trimesh.Trimesh:
    """A tumbler with a hollow."""
    return lathe([(24, 0), (29, 70), (25.5, 70), (21, 5)])


def bottle() -> trimesh.Trimesh:
    """A bottle with a shoulder and a neck."""
    shoulder = [(12 + 14 * np.cos(t), 58 + 14 * np.sin(t)) for t in np.linspace(0, np.pi / 2, 9)]
    return lathe([(24, 0), (26, 3), *shoulder, (10, 76), (10, 92), (12, 92), (12, 100)])


def l_block() -> trimesh.Trimesh:
    """An upright prism over an L; its fans need the mean of the corners to see them all, so corners are repeated."""
    corners = np.array([(0, 0), (62, 0), (62, 26), (26, 26), (26, 58), (0, 58)], dtype=np.float64)
    mesh = prism(corners, 48.0)
    inside = np.array([13.0, 13.0]) * MM  # the corner square sees both arms whole
    mesh.vertices[-2:, :2] = inside
    return mesh


def hexagon() -> trimesh.Trimesh:
    """A hexagonal prism."""
    return prism(polygon(6, 28.0), 60.0)


def cone() -> trimesh.Trimesh:
    """A blunt cone."""
    return lathe([(32, 0), (14, 75)])


def plate() -> trimesh.Trimesh:
    """A thin plate standing on its edge."""
    return block(60.0, 8.0, 50.0)


def wedge() -> trimesh.Trimesh:
    """A ramp: its top runs from 20 to 55 mm."""
    mesh = block(60.0, 40.0, 55.0)
    v = mesh.vertices.copy()
    low = (v[:, 2] > 0.01) & (v[:, 0] < -1e-6)
    v[low, 2] = 20.0 * MM
    v[-1, 2] = 37.5 * MM
    mesh.vertices = v
    return mesh


def mushroom() -> trimesh.Trimesh:
    """A foot, a thin stem and a cap that hangs over both."""
    cap = [(34 * np.cos(t), 50 + 22 * np.sin(t)) for t in np.linspace(0, 0.49 * np.pi, 13)]
    return lathe([(22, 0), (22, 8), (11, 14), (11, 46), *cap])


def star() -> trimesh.Trimesh:
    """A five-pointed star prism."""
    return prism(polygon(5, 36.0, 20.0), 45.0)


def disc() -> trimesh.Trimesh:
    """A flat disc."""
    return lathe([(30, 0), (30, 25)])


def egg() -> trimesh.Trimesh:
    """An egg on a small flat."""
    t = np.linspace(-0.4 * np.pi, 0.495 * np.pi, 40)
    r, z = 25 * np.cos(t) * (1 - 0.12 * np.sin(t)), 34 * np.sin(t)
    return lathe(list(zip(r, z - z.min(), strict=True)))


def tower() -> trimesh.Trimesh:
    """A tall slim box."""
    return block(30.0, 30.0, 110.0)


def blob() -> trimesh.Trimesh:
    """A lumpy ball on a flat, of 100 000 faces."""
    rows, columns = 225, 224
    t = np.linspace(-0.49, 0.49, rows)[:, None] * np.pi
    a = np.linspace(0.0, 2 * np.pi, columns, endpoint=False)[None]
    lobes, ripples = 0.10 * np.cos(3 * a) * np.cos(t) ** 3, 0.01 * np.sin(24 * a) * np.cos(t) ** 4
    r = 28 * (1 + lobes + 0.08 * np.sin(4 * t + 0.5) + ripples)
    rings = np.stack([r * np.cos(t) * np.cos(a), r * np.cos(t) * np.sin(a), r * np.sin(t) * np.ones_like(a)], -1)
    rings[..., 2] = np.maximum(rings[..., 2], -18.0)
    return loft(rings * MM)


def offcentre() -> trimesh.Trimesh:
    """A frustum of eight sides whose file's origin lies just outside it."""
    return _moved(prism(polygon(8, 27.0), 52.0, 0.8), 0.045, 0.030, 0.0)


def faraway() -> trimesh.Trimesh:
    """A box whose file's origin is metres away."""
    return _moved(block(54.0, 34.0, 46.0), 3.0, -2.0, 1.5)


def wide() -> trimesh.Trimesh:
    """A block that no jaw of 85 mm spans."""
    return block(92.0, 90.0, 45.0)


def _jar(waist_mm: float) -> trimesh.Trimesh:
    """A jar of 56 mm whose wall draws in by `waist_mm` half way up; foot, height and neck do not depend on it."""
    z = np.linspace(0.0, 66.0, 23)
    wall = 28.0 - waist_mm * np.sin(np.pi * z / 66.0) ** 2
    return lathe([*zip(wall, z, strict=True), (20.0, 74.0), (20.0, 82.0)])


def jar() -> trimesh.Trimesh:
    """A jar with a straight wall."""
    return _jar(0.0)


def jar_waisted() -> trimesh.Trimesh:
    """The same jar with a slight waist: its near-duplicate."""
    return _jar(2.5)


def house() -> trimesh.Trimesh:
    """A block with a steep roof."""
    x, y = 0.5 * np.array([[1, -1, -1, 1], [1, 1, -1, -1]]) * [[70.0], [44.0]]
    rings = [np.column_stack([x, y * k, np.full(4, z)]) for k, z in ((1.0, 0.0), (1.0, 36.0), (0.15, 64.0))]
    return loft(np.stack(rings) * MM)


def cross() -> trimesh.Trimesh:
    """An upright prism over a plus sign."""
    a, b = 33.0, 12.0
    quarter = np.array([(a, -b), (a, b), (b, b)])
    turns = [np.array([[c, s], [-s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    return prism(np.concatenate([quarter @ t for t in turns]), 52.0)


def twist() -> trimesh.Trimesh:
    """A square column that turns by 50 degrees on its way up."""
    corners = 21.0 * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], dtype=np.float64)
    at = np.linspace(0.0, 1.0, 8, endpoint=False)[:, None]
    outline = np.concatenate(
        [(1 - at) * p + at * q for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    )
    rings = []
    for k in np.linspace(0.0, 1.0, 41):
        c, s = np.cos(np.deg2rad(50.0) * k), np.sin(np.deg2rad(50.0) * k)
        rings.append(np.column_stack([outline @ np.array([[c, s], [-s, c]]), np.full(len(outline), 92.0 * k)]))
    return loft(np.stack(rings) * MM)


SETS: Mapping[str, tuple[Callable[[], trimesh.Trimesh], ...]] = {
    "easy": (cup, bottle, l_block, hexagon, cone),
    "duplicates": (jar, jar_waisted, house, cross, twist),
    "hard": (plate, wedge, mushroom, star, disc, egg, tower, blob, offcentre, faraway, wide),
}
SHAPES: Mapping[str, Callable[[], trimesh.Trimesh]] = {f.__name__: f for made in SETS.values() for f in made}


def write(folder: Path, names: Sequence[str]) -> None:
    """Write the named shapes as binary STL files into a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        SHAPES[name]().export(folder / f"{name}.stl")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write stand-in objects as STL files; returns 0."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--set", choices=[*SETS, "all"], default="easy", dest="chosen")
    parser.add_argument("--names", nargs="*", choices=sorted(SHAPES), help="these instead of a set")
    options = parser.parse_args(arguments)
    chosen = SHAPES if options.chosen == "all" else [f.__name__ for f in SETS[options.chosen]]
    write(options.folder, options.names or list(chosen))
    return 0


if __name__ == "__main__":
    sys.exit(main())
