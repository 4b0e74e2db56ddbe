"""Corners of the container in which the probe is measured: the one nearest to its holder, or the next that is free."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, World
from glotouch_bt.skill.probing import HeldTool


def corners(world: World) -> list[Array]:
    """Return the corners, each as the signs (2,) of its coordinates in K, the nearest to the holder first."""
    holder_K = world.container.pose_B_K.inverse().apply(world.holder.pose_B_grasp.position_m)[:2]
    signs = [np.array([x, y]) for x in (1.0, -1.0) for y in (1.0, -1.0)]
    half = 0.5 * np.array(world.container.interior_m[:2])
    return sorted(signs, key=lambda corner: float(np.linalg.norm(corner * half - holder_K)))


def corner_of(world: World, tool: HeldTool) -> Array:
    """Return the corner in which the tool touched the floor, or the nearest to the holder."""
    return corners(world)[0] if tool.corner is None else tool.corner


def corner_place(world: World, corner: Array, gap_m: float) -> Array:
    """Return the place (2,) in K in a corner, `gap_m` from both walls."""
    return corner * (0.5 * np.array(world.container.interior_m[:2]) - gap_m)


def corner_walls(corner: Array) -> tuple[str, str]:
    """Return the names of a corner's two walls in the arm's scene, the wall normal to x_K first."""
    sides = ["+" if s > 0 else "-" for s in corner]
    return f"wall {sides[0]}x", f"wall {sides[1]}y"
