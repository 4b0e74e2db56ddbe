"""Tops of parts of a solid: what the probe measures as the height of an object of which it traced only a part."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from glotouch_bt.robot import Array

if TYPE_CHECKING:
    import trimesh

TOPS = 8
"""Number of discs."""
CELL_M = 0.002
"""Distance of the places at which the solid's height is sampled."""


def tops_within(solid: trimesh.Trimesh, radius_m: float) -> Array:
    """Return the tops (TOPS,) of a solid within discs about the origin, from `radius_m / TOPS` to `radius_m`.

    The solid stands on z = 0. The last value is its whole height.
    """
    steps = np.arange(-radius_m, radius_m + CELL_M, CELL_M)
    x, y = (a.ravel() for a in np.meshgrid(steps, steps, indexing="ij"))
    top = float(solid.bounds[1, 2])
    above = np.column_stack([x, y, np.full(x.size, top + 0.01)])
    met, rays, _ = solid.ray.intersects_location(above, np.tile([0.0, 0.0, -1.0], (x.size, 1)), multiple_hits=False)
    far = np.hypot(x[rays], y[rays])
    limits = radius_m * np.arange(1, TOPS) / TOPS
    return np.array([*(met[far <= limit, 2].max(initial=0.0) for limit in limits), top])
