"""Planar worlds with the layouts that the backends draw for a seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from glotouch_bt.bench.planar.section import felt_section
from glotouch_bt.bench.planar.world import PlanarWorld
from glotouch_bt.robot import World
from glotouch_bt.robot.scene import UPRIGHT, Mesh, Quat, draw_layout, stream, turned

CORNER_GAP_M = 0.018
"""Start distance of the ball from both walls of the corner nearest to the holder, or of the next that is free."""


def lowered(mesh: Mesh, quat: Quat) -> Mesh:
    """Return the mesh turned about its origin, its lowest vertex at z = 0."""
    if quat == UPRIGHT:
        return mesh
    vertices = turned(mesh, quat).vertices_m
    vertices = vertices - [0.0, 0.0, vertices[:, 2].min()]
    return replace(mesh, vertices_m=vertices, digest=f"{mesh.digest} {quat}")


def planar_world(world: World, meshes: Sequence[Mesh], seed: int) -> PlanarWorld:
    """Return the layout of a seed, with the ball where `tool_pickup` leaves it."""
    places = draw_layout(meshes, world, seed)
    meshes = [lowered(m, p.quat) for m, p in zip(meshes, places, strict=True)]
    half = 0.5 * np.array(world.container.interior_m[:2])
    holder = world.container.pose_B_K.inverse().apply(world.holder.pose_B_grasp.position_m)[:2]
    planar = PlanarWorld(
        [felt_section(m, world.probe) for m in meshes],
        np.array([(p.x_m, p.y_m, p.yaw_rad) for p in places]),
        half,
        world.probe.tip_radius_m,
        stream(seed, "planar contacts"),
    )
    corners = [np.array([x, y]) * (half - CORNER_GAP_M) for x in (1.0, -1.0) for y in (1.0, -1.0)]
    corners.sort(key=lambda place: float(np.linalg.norm(place - holder)))
    free = [c for c in corners if all(planar.clearance(c[None], i, above=True)[0] > 0.0 for i in range(len(meshes)))]
    planar.tip_K_m = (free or corners)[0]
    return planar
