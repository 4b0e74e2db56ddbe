"""The corner of the container for measuring the probe: the one nearest to its holder, which no object reaches."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, World


def quiet_corner(world: World) -> Array:
    """Return the signs (2,) of the coordinates in K of the corner nearest to the holder."""
    holder_K = world.container.pose_B_K.inverse().apply(world.holder.pose_B_grasp.position_m)
    return np.where(holder_K[:2] >= 0, 1.0, -1.0)


def corner_place(world: World, gap_m: float) -> Array:
    """Return the place (2,) in K in that corner, `gap_m` from both walls."""
    return quiet_corner(world) * (0.5 * np.array(world.container.interior_m[:2]) - gap_m)


def corner_walls(world: World) -> tuple[str, str]:
    """Return the names of that corner's two walls in the arm's scene, the wall normal to x_K first."""
    sides = ["+" if s > 0 else "-" for s in quiet_corner(world)]
    return f"wall {sides[0]}x", f"wall {sides[1]}y"
