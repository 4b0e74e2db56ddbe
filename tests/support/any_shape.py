"""Solids of any shape, drawn from a seed: `python tests/support/any_shape.py DIR --seed 1 [--count 5]`.

Kinds: union of primitives, flat, ring, handle, slender, concave, and overlapping shells. Each solid is watertight, in
metres, stands upright, measures 2 to 11 cm and fits between the jaws in at least one direction. All but `shells` are
level sets of signed distances, so that any union, cut or hollow is one closed surface.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import ConvexHull, QhullError

Array = npt.NDArray[np.float64]
Draw = np.random.Generator
Field = Callable[[Array], Array]
"""Signed distance (n,) of points (n, 3) from a surface, negative inside, m."""

CELL_M = 0.002
"""Edge of a cell of the grid; sharp edges are cut by less than half of it."""
NARROWEST_M = 0.072
"""Largest width in the narrowest direction: a stroke of 85 mm less a gap of 4 mm on each side, and some scale."""
MIN_FOOT_M = 0.004
"""Least distance of the centre of mass from the edge of the foot's hull."""
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]])
"""Kuhn's division of a cube; bit k of a corner's number is its place along axis k. Neighbours share their diagonals."""


def surface(field: Field, low_m: Array, high_m: Array) -> trimesh.Trimesh:
    """Return the zero level of a field within a box (3,), (3,) as a closed mesh, by marching tetrahedra."""
    counts = np.ceil((high_m - low_m) / CELL_M).astype(int) + 5
    axes = [l + CELL_M * (np.arange(n) - 2.37) for l, n in zip(low_m, counts, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    value = field(grid)
    value = np.where(np.abs(value) < 0.03 * CELL_M, 0.03 * CELL_M, value)
    number = np.arange(len(grid)).reshape(counts)
    cubes = np.stack([number[a : a + counts[0] - 1 or None, b : b + counts[1] - 1, c : c + counts[2] - 1].ravel()
                      for c in (0, 1) for b in (0, 1) for a in (0, 1)], axis=1)  # fmt: skip
    inside = value < 0
    share = inside[cubes].sum(axis=1)
    tets = cubes[(share > 0) & (share < 8)][:, TETRAHEDRA].reshape(-1, 4)
    tets = np.take_along_axis(tets, np.argsort(~inside[tets], axis=1, kind="stable"), axis=1)  # inside corners first
    n_in = inside[tets].sum(axis=1)
    pairs = {1: [[(0, 1), (0, 2), (0, 3)]], 2: [[(0, 2), (0, 3), (1, 3)], [(0, 2), (1, 3), (1, 2)]],
             3: [[(0, 3), (1, 3), (2, 3)]]}  # fmt: skip
    edges, towards = [], []
    for n, triangles in pairs.items():
        t = tets[n_in == n]
        out = grid[t[:, n:]].mean(axis=1) - grid[t[:, :n]].mean(axis=1)
        for triangle in triangles:
            edges.append(t[:, np.array(triangle)])  # (k, 3, 2): an inside and an outside corner each
            towards.append(out)
    edge, outwards = np.concatenate(edges), np.concatenate(towards)
    key, faces = np.unique(np.sort(edge.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    a, b = key.T
    at = (value[a] / (value[a] - value[b]))[:, None]
    vertices = grid[a] + at * (grid[b] - grid[a])
    faces = faces.reshape(-1, 3)
    normal = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    wrong = (normal * outwards).sum(axis=1) < 0
    faces[wrong] = faces[wrong][:, ::-1]
    return trimesh.Trimesh(vertices, faces, process=False)


def box(middle: Array, half: Array, yaw: float = 0.0) -> Field:
    """An upright box."""
    c, s = np.cos(yaw), np.sin(yaw)

    def distance(p: Array) -> Array:
        q = p - middle
        d = np.abs(np.stack([c * q[:, 0] + s * q[:, 1], -s * q[:, 0] + c * q[:, 1], q[:, 2]], axis=1)) - half
        return np.asarray(np.linalg.norm(np.maximum(d, 0), axis=1) + np.minimum(d.max(axis=1), 0))

    return distance


def cylinder(middle: Array, radius: float, half: float, axis: int = 2, slope: float = 0.0) -> Field:
    """A cylinder along an axis, or a cone whose radius changes by `slope` per metre."""

    def distance(p: Array) -> Array:
        q = p - middle
        r = np.linalg.norm(np.delete(q, axis, axis=1), axis=1) - np.maximum(radius + slope * q[:, axis], 0.0)
        return np.asarray(np.maximum(r / np.hypot(1.0, slope), np.abs(q[:, axis]) - half))

    return distance


def ellipsoid(middle: Array, half: Array) -> Field:
    """An ellipsoid; the distance is of first order."""
    return lambda p: np.asarray((np.linalg.norm((p - middle) / half, axis=1) - 1.0) * float(half.min()))


def torus(middle: Array, major: float, minor: float, axis: int = 2, oblong: float = 1.0) -> Field:
    """A torus about an axis, stretched along the first of the others."""

    def distance(p: Array) -> Array:
        q = p - middle
        flat = np.delete(q, axis, axis=1) / [oblong, 1.0]
        return np.asarray(np.hypot(np.linalg.norm(flat, axis=1) - major, q[:, axis]) - minor)

    return distance


def union(*parts: Field) -> Field:
    """All parts."""
    return lambda p: np.min([part(p) for part in parts], axis=0)


def without(whole: Field, *parts: Field) -> Field:
    """The whole less the parts."""
    return lambda p: np.max([whole(p), *(-part(p) for part in parts)], axis=0)


def at(x: float, y: float, z: float) -> Array:
    """Return a point."""
    return np.array([x, y, z], dtype=np.float64)


def above_floor(field: Field, height_m: float = 0.13, reach_m: float = 0.075) -> trimesh.Trimesh:
    """Return what of the field is above z = 0."""
    cut: Field = lambda p: np.maximum(field(p), -p[:, 2])  # noqa: E731
    return surface(cut, at(-reach_m, -reach_m, 0.0), at(reach_m, reach_m, height_m))


def primitive(rng: Draw, middle: Array) -> Field:
    """A box, cylinder, cone, ellipsoid or torus of 2 to 8 cm."""
    kind = int(rng.integers(5))
    if kind == 0:
        return box(middle, rng.uniform(0.010, 0.034, 3), rng.uniform(0, np.pi))
    if kind == 1:
        return cylinder(middle, rng.uniform(0.010, 0.030), rng.uniform(0.010, 0.040), int(rng.integers(3)))
    if kind == 2:
        return cylinder(middle, rng.uniform(0.014, 0.026), rng.uniform(0.015, 0.035), 2, rng.uniform(-0.6, 0.2))
    if kind == 3:
        return ellipsoid(middle, rng.uniform(0.014, 0.034, 3))
    return torus(middle, rng.uniform(0.016, 0.026), rng.uniform(0.006, 0.010), int(rng.integers(3)))


def mixed(rng: Draw) -> trimesh.Trimesh:
    """A union of two to four primitives, the floor cutting the lowest."""
    spread = at(0.018, 0.018, 0.022)
    places = [rng.uniform(-spread, spread) + at(0, 0, 0.028) for _ in range(int(rng.integers(2, 5)))]
    foot = box(at(0, 0, 0.005), rng.uniform([0.014, 0.014, 0.005], [0.028, 0.028, 0.008]), rng.uniform(0, np.pi))
    return above_floor(union(foot, *(primitive(rng, p) for p in places)))


def flat(rng: Draw) -> trimesh.Trimesh:
    """A plate, disc, angle or star of 15 to 25 mm height, perhaps with a dome or a recess."""
    h = 0.5 * rng.uniform(0.015, 0.025)
    arms = int(rng.integers(1, 4))
    parts = [box(at(*rng.uniform(-0.012, 0.012, 2), h), at(*rng.uniform(0.010, 0.040, 2), h), rng.uniform(0, np.pi))
             for _ in range(arms)]  # fmt: skip
    if rng.random() < 0.4:
        parts[0] = cylinder(at(0, 0, h), rng.uniform(0.018, 0.033), h)
    whole = union(*parts)
    if rng.random() < 0.3:
        whole = without(whole, ellipsoid(at(0, 0, 2 * h), at(0.014, 0.014, 0.6 * h)))
    return above_floor(whole, 0.03)


def ring(rng: Draw) -> trimesh.Trimesh:
    """A lying torus, a tube, or either with a gap."""
    if rng.random() < 0.5:
        minor = rng.uniform(0.009, 0.013)
        solid = torus(at(0, 0, 0.75 * minor), rng.uniform(0.019, 0.031), minor, 2, rng.uniform(1.0, 1.4))
    else:
        r, h = rng.uniform(0.022, 0.035), 0.5 * rng.uniform(0.016, 0.05)
        hole = cylinder(at(0, 0, h), r - rng.uniform(0.006, 0.012), 2 * h)
        solid = without(cylinder(at(0, 0, h), r, h), hole)
    if rng.random() < 0.35:
        solid = without(solid, box(at(0.05, 0, 0), at(0.05, rng.uniform(0.008, 0.016), 0.1)))
    return above_floor(solid, 0.07)


def handle(rng: Draw) -> trimesh.Trimesh:
    """A mug with a handle at its side, or a body with a bow on top."""
    r, h = rng.uniform(0.020, 0.030), 0.5 * rng.uniform(0.035, 0.075)
    body = cylinder(at(0, 0, h), r, h, 2, rng.uniform(-0.12, 0.12))
    if rng.random() < 0.35:
        body = box(at(0, 0, h), at(r, rng.uniform(0.012, r), h))
    minor = rng.uniform(0.004, 0.006)
    if rng.random() < 0.6:
        bow = torus(at(r + 0.003, 0, h), rng.uniform(0.5, 0.8) * h, minor, 1)
        solid = union(body, bow)
        if rng.random() < 0.7:
            solid = without(solid, cylinder(at(0, 0, h + 0.006), r - 0.005, h))
    else:
        solid = union(body, torus(at(0, 0, 2 * h), 0.7 * r, minor, int(rng.integers(2))))
    return above_floor(solid)


def slender(rng: Draw) -> trimesh.Trimesh:
    """A lying bar, a post, or a bent bar."""
    kind, w = int(rng.integers(4)), rng.uniform(0.008, 0.012)
    length = rng.uniform(0.040, 0.052)
    if kind == 0:
        solid = box(at(0, 0, w), at(length, rng.uniform(0.008, 0.013), w))
    elif kind == 1:
        solid = union(cylinder(at(0, 0, 0.8 * w), w, length, 0), box(at(0, 0, 0.002), at(0.8 * length, w, 0.004)))
    elif kind == 2:
        r, h = rng.uniform(0.011, 0.016), rng.uniform(0.038, 0.052)
        solid = cylinder(at(0, 0, h), r, h, 2, rng.uniform(-0.08, 0.0))
    else:
        bent = rng.uniform(0.5, 1.4)
        arm = box(at(0.6 * length * np.cos(bent), 0.6 * length * np.sin(bent), w), at(0.6 * length, w, w), bent)
        solid = union(box(at(-0.5 * length, 0, w), at(0.6 * length, w, w)), arm)
    return above_floor(solid)


def concave(rng: Draw) -> trimesh.Trimesh:
    """A U, C, H, bowl or spool."""
    kind, h = int(rng.integers(4)), 0.5 * rng.uniform(0.030, 0.070)
    a, b = rng.uniform(0.026, 0.045), rng.uniform(0.022, 0.033)
    block = box(at(0, 0, h), at(a, b, h))
    if kind == 0:
        return above_floor(without(block, box(at(0, b, h), at(a - rng.uniform(0.009, 0.014), b, 2 * h))))
    if kind == 1:
        depth = b - rng.uniform(0.006, 0.010)
        notches = [box(at(0, s * b, h), at(0.5 * a, depth, 2 * h)) for s in (-1, 1)]
        return above_floor(without(block, *notches))
    if kind == 2:
        bowl = ellipsoid(at(0, 0, 0.034), at(0.034, 0.034, 0.030))
        cut = box(at(0, 0, 0.1), at(0.1, 0.1, 0.1 - rng.uniform(0.026, 0.040)))
        return above_floor(union(without(bowl, ellipsoid(at(0, 0, 0.040), at(0.027, 0.027, 0.026)), cut),
                                 cylinder(at(0, 0, 0.004), 0.018, 0.004)))  # fmt: skip
    spool = [cylinder(at(0, 0, z), 0.7 * a, 0.25 * h) for z in (0.25 * h, 1.75 * h)]
    return above_floor(union(cylinder(at(0, 0, h), 0.35 * a, h), *spool))


def shells(rng: Draw) -> trimesh.Trimesh:
    """Two or three overlapping closed shells that were never joined, as modelling programs export them."""
    make = trimesh.creation
    parts = [make.box(rng.uniform(0.02, 0.06, 3)) for _ in range(int(rng.integers(1, 3)))]
    if rng.random() < 0.5:
        parts.append(make.cylinder(rng.uniform(0.010, 0.028), rng.uniform(0.02, 0.08), sections=40))
    else:
        parts.append(make.icosphere(3, rng.uniform(0.014, 0.030)))
    for part in parts:
        part.apply_translation([*rng.uniform(-0.012, 0.012, 2), -part.bounds[0, 2] + rng.uniform(0, 0.006)])
    parts[0].apply_translation([0, 0, -parts[0].bounds[0, 2]])
    return trimesh.util.concatenate(parts)


KINDS: tuple[Callable[[Draw], trimesh.Trimesh], ...] = (mixed, flat, ring, handle, slender, concave, shells)


def usable(mesh: trimesh.Trimesh) -> bool:
    """It is one body of 2 to 11 cm that stands, the jaws span it, and the probe does not pass over it."""
    if len(mesh.faces) < 4 or not mesh.is_watertight:
        return False
    v = np.asarray(mesh.vertices)
    top = float(np.ptp(v[:, 2]))
    low = v[v[:, 2] < v[:, 2].min() + 3e-4, :2]
    try:
        foot = ConvexHull(low).equations
    except (QhullError, ValueError):
        return False
    a = np.linspace(0.0, np.pi, 36)
    narrow = np.ptp(v[:, :2] @ np.stack([np.cos(a), np.sin(a)]), axis=0).min()
    stands = (foot[:, :2] @ mesh.center_mass[:2] + foot[:, 2]).max() < -MIN_FOOT_M
    return bool(stands and narrow < NARROWEST_M and top >= 0.015 and 0.02 < mesh.extents.max() < 0.115)


def drawn(rng: Draw, kind: Callable[[Draw], trimesh.Trimesh] | None = None) -> trimesh.Trimesh:
    """Return the first usable solid of a kind, or of a drawn kind; its middle is at the origin, its foot on z = 0."""
    make = kind or KINDS[int(rng.integers(len(KINDS)))]
    while True:
        mesh = make(rng)
        if make is not shells:
            mesh = max(mesh.split(only_watertight=False), key=lambda m: len(m.faces))
        if usable(mesh):
            low, high = mesh.bounds
            mesh.apply_translation([*(-0.5 * (low + high))[:2], -low[2]])
            return mesh


def main() -> int:
    """Write STL files of different kinds; returns 0."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=5)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    order = rng.permutation(len(KINDS))
    for i in range(options.count):
        kind = KINDS[order[i % len(KINDS)]]
        drawn(rng, kind).export(options.folder / f"{kind.__name__}_{options.seed}_{i}.stl")
    return 0


if __name__ == "__main__":
    sys.exit(main())
