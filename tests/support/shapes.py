"""Objects that are not shipped, made by formula, by which tests try that nothing leans on the shipped five.

Watertight solids of 4-11 cm in metres, upright: thin, flat, overhanging, star-shaped, wider than the jaws open.
Deterministic; every mesh is built face by face from numpy alone.
"""

from __future__ import annotations

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


def prism(outline_mm: Array, height_mm: float) -> trimesh.Trimesh:
    """An upright prism over an outline (n, 2), anticlockwise, seen whole from the mean of its points."""
    rings = np.stack([np.column_stack([outline_mm, np.full(len(outline_mm), z)]) for z in (0.0, height_mm)])
    return loft(rings * MM)


def block(x_mm: float, y_mm: float, z_mm: float) -> trimesh.Trimesh:
    """An upright box."""
    return prism(0.5 * np.array([x_mm, y_mm]) * [[1, 1], [-1, 1], [-1, -1], [1, -1]], z_mm)


def cup() -> trimesh.Trimesh:
    """A tumbler with a hollow."""
    return lathe([(24, 0), (29, 70), (25.5, 70), (21, 5)])


def l_block() -> trimesh.Trimesh:
    """An upright prism over an L; its fans need the mean of the corners to see them all, so corners are repeated."""
    corners = np.array([(0, 0), (62, 0), (62, 26), (26, 26), (26, 58), (0, 58)], dtype=np.float64)
    mesh = prism(corners, 48.0)
    inside = np.array([13.0, 13.0]) * MM  # the corner square sees both arms whole
    mesh.vertices[-2:, :2] = inside
    return mesh


def plate() -> trimesh.Trimesh:
    """A thin plate standing on its edge."""
    return block(60.0, 8.0, 50.0)


def mushroom() -> trimesh.Trimesh:
    """A foot, a thin stem and a cap that hangs over both."""
    cap = [(34 * np.cos(t), 50 + 22 * np.sin(t)) for t in np.linspace(0, 0.49 * np.pi, 13)]
    return lathe([(22, 0), (22, 8), (11, 14), (11, 46), *cap])


def star() -> trimesh.Trimesh:
    """A five-pointed star prism."""
    k = np.arange(10)
    r = np.where(k % 2 == 0, 36.0, 20.0)[:, None]
    return prism(r * np.column_stack([np.cos(k * np.pi / 5), np.sin(k * np.pi / 5)]), 45.0)


def disc() -> trimesh.Trimesh:
    """A flat disc."""
    return lathe([(30, 0), (30, 25)])


def wide() -> trimesh.Trimesh:
    """A block that no jaw of 85 mm spans."""
    return block(92.0, 90.0, 45.0)


def jar() -> trimesh.Trimesh:
    """A jar of 56 mm with a straight wall."""
    return lathe([(28, 0), (28, 66), (20, 74), (20, 82)])


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


SHAPES: Mapping[str, Callable[[], trimesh.Trimesh]] = {
    f.__name__: f for f in (cup, l_block, plate, mushroom, star, disc, wide, jar, house, cross)
}


def write(folder: Path, names: Sequence[str]) -> None:
    """Write the named shapes as binary STL files into a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        SHAPES[name]().export(folder / f"{name}.stl")
