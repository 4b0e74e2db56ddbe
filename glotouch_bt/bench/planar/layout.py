"""Planar worlds with the layouts that the backends draw for a seed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glotouch_bt.bench.planar.section import felt_section
from glotouch_bt.bench.planar.world import ContactModel, PlanarWorld
from glotouch_bt.robot import World
from glotouch_bt.robot.scene import Mesh, draw_layout, stream

CORNER_GAP_M = 0.018
"""Start distance of the ball from both walls of the corner nearest to the holder."""


def planar_world(world: World, meshes: Sequence[Mesh], seed: int, model: ContactModel | None = None) -> PlanarWorld:
    """Return the layout of a seed, with the ball where `tool_pickup` leaves it."""
    places = draw_layout(meshes, world, seed)
    half = 0.5 * np.array(world.container.interior_m[:2])
    holder = world.container.pose_B_K.inverse().apply(world.holder.pose_B_grasp.position_m)[:2]
    return PlanarWorld(
        [felt_section(m, world.probe) for m in meshes],
        np.array([(p.x_m, p.y_m, p.yaw_rad) for p in places]),
        half,
        world.probe.tip_radius_m,
        stream(seed, "planar contacts"),
        model,
        np.where(holder >= 0, half - CORNER_GAP_M, CORNER_GAP_M - half),
    )
