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
    outlines: Sequence[Array], half: Array, min_gap_m: float, min_wall_gap_m: float, rng: np.random.Generator
) -> list[Placement] | int:
    """Try to place all outlines in the given order; return the index that does not fit if it fails."""
    done: list[Placement] = []
    placed: list[tuple[Array, Placement, float]] = []
    limit = half - min_wall_gap_m
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
                done.append(place)
                placed.append((polygon, place, reach))
                break
        else:
            return i
    return done


def place_objects(
    meshes: Sequence[Mesh],
    interior_m: tuple[float, float],
    min_gap_m: float,
    min_wall_gap_m: float,
    rng: np.random.Generator,
) -> list[Placement]:
    """Return a random layout in K, in the order of `meshes`.

    Args:
        meshes: The objects.
        interior_m: Interior size along x_K and y_K.
        min_gap_m: Least distance between the convex outlines of two objects.
        min_wall_gap_m: Least distance between an outline and a wall.
        rng: Source of all draws.

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
            result = _place_all([outlines[i] for i in order], half, min_gap_m, min_wall_gap_m, rng)
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
        sides = [draw_stance(m, rng) for m in meshes]
        meshes = [turned(m, quat) for m, quat in zip(meshes, sides, strict=True)]
    places = place_objects(
        meshes, (interior[0], interior[1]), objects.min_gap_m, objects.min_wall_gap_m, stream(seed, "layout")
    )
    return [replace(place, quat=quat) for place, quat in zip(places, sides, strict=True)]
