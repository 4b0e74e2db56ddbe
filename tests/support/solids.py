"""Five random solids of mixed kinds, and twins of them: `python tests/solids.py DIR --seed 1 [--twins | --of FOLDER]`.

Kinds: convex polytope, chamfered prism, turned profile, L or T extrusion, ball on a plate, stacked slabs, lobed figure;
a folder has five different ones, drawn from the seed. With `--twins` the last two are twins of the first two: the same
solid but for a waist, taper, stretch or belt that moves its wall by 2.5 to 5 mm at most. `--of FOLDER` writes a twin of
every STL of a folder instead: targets that are not in the box, but something like them is. Watertight, 4-11 cm.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import ConvexHull

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support import lobes
from tests.support.shapes import loft

Array = npt.NDArray[np.float64]
Draw = np.random.Generator
COLUMNS = 96
ANGLES = np.linspace(0.0, 2 * np.pi, COLUMNS, endpoint=False)


def polar(rows: Sequence[tuple[float, Array | float]]) -> trimesh.Trimesh:
    """A solid through rings of (height, radius over `ANGLES`), bottom first."""
    r = np.stack([np.broadcast_to(radius, COLUMNS) for _, radius in rows])
    z = np.broadcast_to(np.array([height for height, _ in rows])[:, None], r.shape)
    return loft(np.stack([r * np.cos(ANGLES), r * np.sin(ANGLES), z], axis=-1))


def reach(corners: Array) -> Array:
    """(COLUMNS,) radius of a polygon (n, 2), anticlockwise and seen whole from the origin."""
    a, b = corners, np.roll(corners, -1, axis=0)
    d = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)[:, None]  # (COLUMNS, 1, 2)
    side = b - a
    cross = d[..., 0] * side[:, 1] - d[..., 1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (a[:, 0] * side[:, 1] - a[:, 1] * side[:, 0]) / cross
        s = (a[:, 0] * d[..., 1] - a[:, 1] * d[..., 0]) / cross
    return np.asarray(np.where((t > 0) & (s >= -1e-9) & (s <= 1 + 1e-9), t, np.inf).min(axis=1))


def rectangle(x: float, y: float) -> Array:
    """Corners of an upright rectangle about the origin."""
    return 0.5 * np.array([x, y]) * np.array([[1, -1], [1, 1], [-1, 1], [-1, -1]], dtype=np.float64)


def polytope(rng: Draw) -> trimesh.Trimesh:
    """The convex hull of points on an ellipsoid, cut flat below."""
    n = int(rng.integers(14, 40))
    p = rng.normal(size=(n, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    p = p * rng.uniform([0.022, 0.024, 0.030], [0.034, 0.042, 0.055])
    p[:, 2] = np.maximum(p[:, 2], -rng.uniform(0.012, 0.022))
    return trimesh.convex.convex_hull(p)


def chamfered(rng: Draw) -> trimesh.Trimesh:
    """A prism of 3 to 8 sides that tapers a little, its upper edge chamfered."""
    n, phase = int(rng.integers(3, 9)), rng.uniform(0, 6)
    a = 2 * np.pi * (np.arange(n) + rng.uniform(-0.15, 0.15, n)) / n + phase
    flat = rng.uniform(0.024, 0.034) * np.stack([np.cos(a), np.sin(a) * rng.uniform(0.8, 1.25)], axis=1)
    r, h, cut = reach(flat), rng.uniform(0.045, 0.10), rng.uniform(0.002, 0.010)
    top = rng.uniform(0.75, 1.05)
    return polar([(0.0, r), (h - cut, r * top), (h, r * top * (1 - cut / 0.03))])


def turned(rng: Draw) -> trimesh.Trimesh:
    """A body of revolution over a smooth profile, perhaps with a neck."""
    h = rng.uniform(0.05, 0.11)
    t = np.linspace(0.0, 1.0, 30)
    r = np.interp(t, np.linspace(0, 1, 5), rng.uniform(0.018, 0.036, 5))
    r = np.convolve(np.pad(r, 3, mode="edge"), np.ones(7) / 7, mode="valid")
    if rng.random() < 0.5:
        r = np.where(t > rng.uniform(0.65, 0.85), rng.uniform(0.009, 0.015), r)
    return polar([(float(h * s), float(q)) for s, q in zip(t, r, strict=True)])


def angled(rng: Draw) -> trimesh.Trimesh:
    """An upright prism over an L or a T, seen whole from where its arms meet."""
    w, v = rng.uniform(0.018, 0.030, 2)
    a, b = rng.uniform(0.018, 0.042, 2)
    c = float(rng.choice([0.0, rng.uniform(0.012, 0.025)]))
    x, y = 0.5 * w, 0.5 * v
    corners = [(-x - c, -y), (x + a, -y), (x + a, y), (x, y), (x, y + b), (-x, y + b), (-x, y), (-x - c, y)]
    flat = np.array(corners if c else [*corners[:5], (-x, y + b)])
    fine = np.concatenate([p + np.linspace(0, 1, 12, endpoint=False)[:, None] * (q - p)
                           for p, q in zip(flat, np.roll(flat, -1, axis=0), strict=True)])  # fmt: skip
    return loft(np.stack([np.column_stack([fine, np.full(len(fine), z)]) for z in (0.0, rng.uniform(0.04, 0.09))]))


def ball(rng: Draw) -> trimesh.Trimesh:
    """A ball that sinks a little into a plate, round or square."""
    plate = reach(rectangle(*rng.uniform(0.045, 0.075, 2))) if rng.random() < 0.6 else rng.uniform(0.024, 0.036)
    thick, r = rng.uniform(0.010, 0.025), rng.uniform(0.019, 0.030)
    below = rng.uniform(0.75, 0.95)
    t = np.linspace(-np.arcsin(below), 0.5 * np.pi - 0.03, 30)
    rows = [(float(thick + r * (below + np.sin(s))), float(r * np.cos(s))) for s in t]
    return polar([(0.0, plate), (thick, plate), *rows])


def stacked(rng: Draw) -> trimesh.Trimesh:
    """Two or three slabs on one another, each turned a little."""
    z, rows = 0.0, []
    for _ in range(int(rng.integers(2, 4))):
        x, y, turn = rng.uniform(0.030, 0.070), rng.uniform(0.026, 0.05), rng.uniform(-0.5, 0.5)
        c, s = np.cos(turn), np.sin(turn)
        r = reach(rectangle(x, y) @ np.array([[c, s], [-s, c]]))
        rows += [(z, r), (z := z + rng.uniform(0.016, 0.034), r)]
    return polar(rows)


KINDS: tuple[Callable[[Draw], trimesh.Trimesh], ...] = (
    polytope, chamfered, turned, angled, ball, stacked, lobes.solid,
)  # fmt: skip


def usable(mesh: trimesh.Trimesh) -> bool:
    """It stands (centre of mass 4 mm inside its foot), the jaws span it, and it measures 4 to 11 cm."""
    v = np.asarray(mesh.vertices)
    low = v[v[:, 2] < v[:, 2].min() + 1e-4, :2]
    if np.linalg.matrix_rank(low - low[0], tol=1e-4) < 2:
        return False
    foot = ConvexHull(low).equations
    a = np.linspace(0.0, np.pi, 36)
    narrow = np.ptp(v[:, :2] @ np.stack([np.cos(a), np.sin(a)]), axis=0).min()
    stands = (foot[:, :2] @ mesh.center_mass[:2] + foot[:, 2]).max() < -0.004
    return bool(stands and narrow < 0.068 and 0.04 < mesh.extents.max() < 0.11)


def drawn(kind: Callable[[Draw], trimesh.Trimesh], rng: Draw) -> trimesh.Trimesh:
    """The first usable one of a kind."""
    while not usable(mesh := kind(rng)):
        pass
    return mesh


def twin(mesh: trimesh.Trimesh, rng: Draw) -> trimesh.Trimesh:
    """The same but for a smooth change: a point as far out as any would move by 2.5 to 5 mm where it is largest."""
    out = mesh.subdivide_to_size(0.008)
    v = np.array(out.vertices)
    v[:, :2] -= 0.5 * (v[:, :2].min(axis=0) + v[:, :2].max(axis=0))
    t = (v[:, 2] - v[:, 2].min()) / np.ptp(v[:, 2])
    far = float(np.linalg.norm(v[:, :2], axis=1).max())
    share = rng.uniform(0.0025, 0.005) / far * rng.choice([-1.0, 1.0])
    kind, at = int(rng.integers(4)), rng.uniform(0.3, 0.8)
    along = (np.sin(np.pi * t) ** 2, t, np.ones_like(t), np.exp(-0.5 * ((t - at) / 0.15) ** 2))[kind]
    v[:, 0] *= 1 + share * along
    v[:, 1] *= 1 + share * along * (kind != 2)
    return trimesh.Trimesh(v, out.faces, process=False)


def main() -> int:
    """Write STL files; returns 0."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--twins", action="store_true")
    parser.add_argument("--of", type=Path)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    if options.of:
        for file in sorted(options.of.glob("*.stl")):
            twin(trimesh.load_mesh(file), rng).export(options.folder / f"{file.stem}_twin.stl")
        return 0
    made = {f"{KINDS[k].__name__}_{options.seed}": drawn(KINDS[k], rng) for k in rng.permutation(len(KINDS))[:5]}
    if options.twins:
        names = list(made)
        for old, model in zip(names[3:], names[:2], strict=True):
            del made[old]
            made[f"{model}_twin"] = twin(made[model], rng)
    for name, mesh in made.items():
        mesh.export(options.folder / f"{name}.stl")
    return 0


if __name__ == "__main__":
    sys.exit(main())
