"""Random layouts: objects in the container at uniform positions and yaws, with gaps to each other and to walls.

Rejection sampling of one object after another, largest first. It restarts when the next object does not fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from glotouch_bt.errors import BadInput
from glotouch_bt.robot.geometry import Array
from glotouch_bt.robot.scene.meshes import Mesh
from glotouch_bt.robot.scene.stances import UPRIGHT, Quat, draw_stance, turned
from glotouch_bt.robot.scene.streams import stream
from glotouch_bt.robot.scene.world import World

MAX_TRIES_PER_OBJECT = 400
"""Number of poses to try for one object before a restart."""
MAX_RESTARTS = 60
"""Number of layouts to try."""
HOPELESS_AFTER = 10
"""Number of layouts after which to give up if none had room for `HOPELESS_SHARE` of the objects."""
HOPELESS_SHARE = 0.75
"""See `HOPELESS_AFTER`."""
ROUNDING_M = 1e-9
"""Bound of the rounding errors of a distance."""
TOUCHING_M = 5e-5
"""Gap between outlines that touch. It keeps the solids of a simulation from overlapping by rounding."""
MAX_ADVANCES = 200
"""Number of steps in which an object is moved until it touches something."""
MAX_SEPARATIONS = 60
"""Number of rounds in which overlapping outlines are moved apart."""


@dataclass(frozen=True)
class Placement:
    """The place of one object in K.

    Attributes:
        x_m, y_m: Origin of its mesh frame, seen from above.
        yaw_rad: Yaw about z, after `quat`.
        quat: Rotation (w x y z) that puts the mesh on the side on which it stands.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    quat: Quat = UPRIGHT


def outline(mesh: Mesh) -> Array:
    """Return the convex outline (n, 2) of the whole mesh from above, anticlockwise, in the mesh frame (m)."""
    xy = np.asarray(mesh.vertices_m)[:, :2]
    return np.asarray(xy[scipy.spatial.ConvexHull(xy).vertices], dtype=np.float64)


def transformed(outline_m: Array, place: Placement) -> Array:
    """Return the outline (n, 2) at a placement."""
    c, s = np.cos(place.yaw_rad), np.sin(place.yaw_rad)
    return np.asarray(outline_m @ np.array([[c, s], [-s, c]]) + (place.x_m, place.y_m))


def _points_to_edges(points: Array, polygon: Array) -> float:
    """Return the least distance from points (n, 2) to the closed boundary of polygon (m, 2)."""
    a = polygon
    ab = np.roll(polygon, -1, axis=0) - a
    ap = points[:, None, :] - a[None, :, :]
    t = np.clip((ap * ab).sum(-1) / np.maximum((ab * ab).sum(-1), 1e-18), 0.0, 1.0)
    return float(np.linalg.norm(ap - t[..., None] * ab, axis=-1).min())


def gap(first: Array, second: Array) -> float:
    """Return the distance between two convex polygons (n, 2), anticlockwise; 0 if they overlap.

    Two disjoint convex polygons are separated along the normal of an edge of one of them, and the nearest points
    include a vertex of one (Ericson, Real-Time Collision Detection, 5.4 and 9.1).
    """
    separated = False
    for a, b in ((first, second), (second, first)):
        edge = np.roll(a, -1, axis=0) - a
        normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        if (((b[None] - a[:, None]) * normal[:, None]).sum(-1).min(axis=1) > 0.0).any():
            separated = True
            break
    if not separated:
        return 0.0
    return min(_points_to_edges(first, second), _points_to_edges(second, first))


def _place_all(
    outlines: Sequence[Array],
    half: Array,
    min_gap_m: float,
    min_wall_gap_m: float,
    rng: np.random.Generator,
    touching_share: float,
) -> list[Placement] | int:
    """Try to place all outlines in the given order; return the index that does not fit if it fails."""
    done: list[Placement] = []
    placed: list[tuple[Array, Placement, float]] = []
    limit = half - max(min_wall_gap_m, TOUCHING_M if touching_share else 0.0)
    min_gap_m = max(min_gap_m, TOUCHING_M)  # a gap of 0 is also that of outlines that overlap
    for i, shape in enumerate(outlines):
        reach = float(np.linalg.norm(shape, axis=1).max())
        for _ in range(MAX_TRIES_PER_OBJECT):
            x, y = rng.uniform(-half - reach, half + reach)
            place = Placement(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
            polygon = transformed(shape, place)
            if (np.abs(polygon) > limit).any():
                continue
            clear = (
                np.hypot(x - there.x_m, y - there.y_m) - reach - far > min_gap_m + ROUNDING_M
                or gap(polygon, other) >= min_gap_m
                for other, there, far in placed
            )
            if all(clear):
                if touching_share and rng.random() < touching_share:
                    place = _moved_until_touching(shape, place, placed, half, rng)
                    polygon = transformed(shape, place)
                done.append(place)
                placed.append((polygon, place, reach))
                break
        else:
            return i
    return done


def _moved_until_touching(
    shape: Array,
    place: Placement,
    placed: Sequence[tuple[Array, Placement, float]],
    half: Array,
    rng: np.random.Generator,
) -> Placement:
    """Return the place moved straight until the outline touches an outline or a wall.

    The direction is towards one of the others, or any. Each step is as long as the nearest gap (conservative
    advancement; Mirtich, 1996), so that nothing overlaps.
    """  # fmt: skip
    towards = int(rng.integers(len(placed) + 1))
    angle = float(rng.uniform(-np.pi, np.pi))
    way = np.array([np.cos(angle), np.sin(angle)])
    if towards < len(placed):
        there = placed[towards][1]
        way = np.array([there.x_m - place.x_m, there.y_m - place.y_m])
        way /= max(float(np.linalg.norm(way)), ROUNDING_M)
    for _ in range(MAX_ADVANCES):
        polygon = transformed(shape, place)
        free = min([float((half - np.abs(polygon)).min()), *(gap(polygon, other) for other, _, _ in placed)])
        if free <= 2.0 * TOUCHING_M:
            break
        step = (free - TOUCHING_M) * way
        place = replace(place, x_m=float(place.x_m + step[0]), y_m=float(place.y_m + step[1]))
    return place


def moved_apart(
    outlines: Sequence[Array], places: Sequence[Placement], interior_m: tuple[float, float]
) -> list[Placement]:
    """Return places at which no outlines (n, 2) overlap, each object moved by little.

    True solids are a little larger than those of their files. Overlapping pairs share the shortest translation that
    separates them; walls push back into the container.

    Args:
        outlines: Convex outlines in the mesh frames as they stand, anticlockwise.
        places: Where they should be.
        interior_m: Interior size along x_K and y_K.
    """
    at = np.array([(p.x_m, p.y_m) for p in places]).reshape(-1, 2)
    turned_m = [transformed(o, replace(p, x_m=0.0, y_m=0.0)) for o, p in zip(outlines, places, strict=True)]
    low = np.array([o.min(axis=0) for o in turned_m]).reshape(-1, 2)
    high = np.array([o.max(axis=0) for o in turned_m]).reshape(-1, 2)
    half = 0.5 * np.array(interior_m) - TOUCHING_M
    for _ in range(MAX_SEPARATIONS):
        before = at.copy()
        at = np.clip(at, -half - low, half - high)
        for i in range(len(at)):
            for j in range(i):
                push = _separation(turned_m[i] + at[i], turned_m[j] + at[j])
                at[i] += 0.5 * push
                at[j] -= 0.5 * push
        if np.array_equal(before, at):
            break
    return [replace(p, x_m=float(x), y_m=float(y)) for p, (x, y) in zip(places, at, strict=True)]


def _separation(first: Array, second: Array) -> Array:
    """Return the shortest translation (2,) of the first of two convex polygons that leaves `TOUCHING_M` of gap.

    Zero if they are farther apart (separating axis theorem).
    """
    best, push = np.inf, np.zeros(2)
    for a, b, sign in ((first, second, -1.0), (second, first, 1.0)):
        edge = np.roll(a, -1, axis=0) - a
        edge = edge[np.linalg.norm(edge, axis=1) > ROUNDING_M]
        normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.linalg.norm(edge, axis=1, keepdims=True)
        depth = (a @ normal.T).max(axis=0) - (b @ normal.T).min(axis=0) + 0.9 * TOUCHING_M
        if depth.min() <= 0.0:
            return np.zeros(2)
        k = int(np.argmin(depth))
        if depth[k] < best:
            best, push = float(depth[k]), sign * (depth[k] + 0.1 * TOUCHING_M) * normal[k]
    return push


def place_objects(
    meshes: Sequence[Mesh],
    interior_m: tuple[float, float],
    min_gap_m: float,
    min_wall_gap_m: float,
    rng: np.random.Generator,
    touching_share: float = 0.0,
) -> list[Placement]:
    """Return a random layout in K, in the order of `meshes`.

    Args:
        meshes: The objects.
        interior_m: Interior size along x_K and y_K.
        min_gap_m: Least distance between the convex outlines of two objects.
        min_wall_gap_m: Least distance between an outline and a wall.
        rng: Source of all draws.
        touching_share: Share of the objects that are moved until they touch another one or a wall.

    Raises:
        BadInput: They do not fit. The message names the object and the available area.
    """
    outlines = [outline(m) for m in meshes]
    half = 0.5 * np.array(interior_m)
    hulls = [scipy.spatial.ConvexHull(o) for o in outlines]
    areas = [h.volume for h in hulls]  # in the plane, scipy's volume is the area and its area the circumference
    order = sorted(range(len(meshes)), key=lambda i: (-areas[i], i))
    # Outlines grown by half a gap do not overlap, and stay inside the walls' gap less half a gap.
    r = 0.5 * min_gap_m
    needed = np.cumsum([areas[i] + hulls[i].area * r + np.pi * r * r for i in order])
    there = float(np.prod(np.maximum(2.0 * (half - min_wall_gap_m + r), 0.0))) * (1.0 + ROUNDING_M)
    failed = int((needed <= there).sum())
    if failed == len(meshes):
        failed = 0
        for n in range(MAX_RESTARTS):
            if n >= HOPELESS_AFTER and failed <= HOPELESS_SHARE * len(meshes):
                break
            result = _place_all([outlines[i] for i in order], half, min_gap_m, min_wall_gap_m, rng, touching_share)
            if isinstance(result, list):
                places: list[Placement] = [result[0]] * len(meshes) if result else []
                for i, place in zip(order, result, strict=True):
                    places[i] = place
                return places
            failed = max(failed, result)
    raise BadInput(
        f"{len(meshes)} objects do not fit into the container: no place found for {meshes[order[failed]].name!r} "
        f"(outlines cover {sum(areas) * 1e4:.0f} of {interior_m[0] * interior_m[1] * 1e4:.0f} cm2, gaps of "
        f"{min_gap_m * 1e3:.0f} mm between objects and {min_wall_gap_m * 1e3:.0f} mm to walls asked); "
        "use fewer or smaller objects, smaller gaps or a larger container"
    )


def draw_layout(meshes: Sequence[Mesh], world: World, seed: int) -> list[Placement]:
    """Return the layout of a trial. Every simulator places the same objects alike with the same seed.

    Gaps are those between the outlines of the STL files, on the sides on which the objects stand.

    Raises:
        BadInput: As `place_objects`.
    """
    objects = world.objects
    interior = world.container.interior_m
    sides = [UPRIGHT] * len(meshes)
    if objects.stance == "any":
        rng = stream(seed, "stances")
        sides = [draw_stance(m, rng, objects.lying_share) for m in meshes]
        meshes = [turned(m, quat) for m, quat in zip(meshes, sides, strict=True)]
    places = place_objects(
        meshes,
        (interior[0], interior[1]),
        objects.min_gap_m,
        objects.min_wall_gap_m,
        stream(seed, "layout"),
        objects.touching_share,
    )
    return [replace(place, quat=quat) for place, quat in zip(places, sides, strict=True)]
