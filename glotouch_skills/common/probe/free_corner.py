"""The corner of the container where the probe is measured: the one nearest to its holder, which no object reaches."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, World


def quiet_corner(world: World) -> Array:
    """(2,) +-1: on which side of K's axes the corner nearest to the holder lies."""
    holder_K = world.container.pose_B_K.inverse().apply(world.holder.pose_B_grasp.position_m)
    return np.where(holder_K[:2] >= 0, 1.0, -1.0)


def corner_place(world: World, gap_m: float) -> Array:
    """(2,) the place in that corner at `gap_m` from both walls, in K."""
    return quiet_corner(world) * (0.5 * np.array(world.container.interior_m[:2]) - gap_m)


def corner_walls(world: World) -> tuple[str, str]:
    """Names of that corner's two walls in the arm's scene, the one across x_K first."""
    sides = ["+" if s > 0 else "-" for s in quiet_corner(world)]
    return f"wall {sides[0]}x", f"wall {sides[1]}y"
