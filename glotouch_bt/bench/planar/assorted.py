"""Planar worlds with a random number of objects of random sizes, shapes and gaps."""

from __future__ import annotations

import numpy as np
import trimesh

from glotouch_bt.bench.planar.layout import CORNER_GAP_M
from glotouch_bt.bench.planar.section import felt_section
from glotouch_bt.bench.planar.world import PlanarWorld
from glotouch_bt.robot import BadInput, World
from glotouch_bt.robot.scene import Mesh, place_objects, stream

COUNT = (1, 8)
"""Range of the number of objects; every number is as likely."""
HALF_WIDTH_M = (0.0075, 0.045)
"""Range of the half mean width: objects of 15-90 mm, log-uniform."""
MIN_SIDE_M = 0.015
"""Shortest side of a box."""
ASPECT = 2.0
"""Largest aspect ratio of a box; half of the objects are boxes, half are cylinders."""
HEIGHT_M = 0.06
"""Height of every object; the ball passes below it."""
GAP_M = (0.02, 0.045)
"""Range of the least gap between objects in a layout."""
WALL_GAP_M = (0.005, 0.04)
"""Range of the least gap between objects and walls in a layout. Source of all ranges: ours."""


def assorted_world(world: World, seed: int) -> PlanarWorld:
    """Return a layout of a seed in the container of a world. Objects that do not fit are left out."""
    rng = stream(seed, "assorted")
    solids = [_solid(rng, f"object{i}") for i in range(int(rng.integers(COUNT[0], COUNT[1] + 1)))]
    gap, wall_gap = (float(rng.uniform(*span)) for span in (GAP_M, WALL_GAP_M))
    interior = world.container.interior_m
    while True:
        try:
            places = place_objects(solids, (interior[0], interior[1]), gap, wall_gap, rng)
            break
        except BadInput:
            solids.pop()
    half = 0.5 * np.array(interior[:2])
    return PlanarWorld(
        [felt_section(m, world.probe) for m in solids],
        np.array([(p.x_m, p.y_m, p.yaw_rad) for p in places]),
        half,
        world.probe.tip_radius_m,
        stream(seed, "planar contacts"),
        start_K_m=CORNER_GAP_M - half,
    )


def _solid(rng: np.random.Generator, name: str) -> Mesh:
    """Return an upright cylinder or box, its origin in the middle of its lowest face."""
    r = float(np.exp(rng.uniform(*np.log(HALF_WIDTH_M))))
    if rng.random() < 0.5:
        solid = trimesh.creation.cylinder(r, HEIGHT_M, sections=96)
    else:  # the half mean width of a rectangle a x b is (a + b) / pi
        short = max(np.pi * r / (1.0 + rng.uniform(1.0, ASPECT)), MIN_SIDE_M)
        solid = trimesh.creation.box((max(np.pi * r - short, short), short, HEIGHT_M))
    vertices = np.asarray(solid.vertices) + np.array([0.0, 0.0, 0.5 * HEIGHT_M])
    return Mesh(name, vertices, np.asarray(solid.faces, dtype=np.int64), f"{name} {vertices.tobytes().hex()}")
