"""Components of a solid that the probe feels as separate objects: the legs of a table, the walls of an open channel.

On a grid, a cell is blocked if the ball centred there, or the shaft above it, would meet the solid. Each connected
component of the blocked cells is traced by itself.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.recognition.model.outline import (
    SENSING_M,
    SHAFT_M,
    SHAFT_RADIUS_M,
    TIP_RADIUS_M,
    Outline,
    outline_of,
)
from glotouch_bt.robot import Array

if TYPE_CHECKING:
    import trimesh

CELL_M = 0.001
"""Edge of a cell of the grid."""
LAYER_M = 0.002
"""Distance of the horizontal sections of the solid."""
MIN_CELLS = 60
"""Minimum number of cells of a component. Source: ours; the ball around a single point blocks 113."""

Mask = npt.NDArray[np.bool_]


def component_outlines(solid: trimesh.Trimesh) -> tuple[Outline, ...]:
    """Return the simulated traces of each component of a solid (z up, standing on z = 0); none if there is only one."""
    low, high = solid.bounds[0, :2] - 2 * TIP_RADIUS_M, solid.bounds[1, :2] + 2 * TIP_RADIUS_M
    axes = [np.arange(l, h, CELL_M) for l, h in zip(low, high, strict=True)]
    label, count = scipy.ndimage.label(_blocked(solid, axes), structure=np.ones((3, 3)))
    outlines = []
    for part in (label == k for k in range(1, count + 1)):
        if part.sum() >= MIN_CELLS:
            middle = np.array([a[i].mean() for a, i in zip(axes, np.nonzero(part), strict=True)])
            tips = _ComponentTips(part, axes)
            outlines.append(outline_of(tips, middle))
    return tuple(outlines) if len(outlines) > 1 else ()


class _ComponentTips:
    """Ball centres at the first contact with one component, as `traced_tips` returns them for a whole solid."""

    def __init__(self, part: Mask, axes: list[Array]) -> None:
        self.part, self.axes = part, axes

    def __call__(self, aim_m: Array, contacts: int, start_rad: float) -> Array:
        angle = start_rad + np.linspace(0, 2 * np.pi, contacts, endpoint=False)
        u = np.column_stack([np.cos(angle), np.sin(angle)])
        reach = float(np.hypot(*(a[-1] - a[0] for a in self.axes)))
        steps = np.arange(reach, 0.0, -0.25 * CELL_M)
        at = aim_m + steps[None, :, None] * u[:, None, :]  # (contacts, steps, 2), from outside inwards
        index = [np.rint((at[..., i] - self.axes[i][0]) / CELL_M).astype(np.int64) for i in range(2)]
        inside = np.all([(i >= 0) & (i < n) for i, n in zip(index, self.part.shape, strict=True)], axis=0)
        met = np.zeros(inside.shape, dtype=bool)
        met[inside] = self.part[index[0][inside], index[1][inside]]
        some = met.any(axis=1)
        return np.asarray(aim_m + steps[met.argmax(axis=1)][some, None] * u[some])


def _blocked(solid: trimesh.Trimesh, axes: list[Array]) -> Mask:
    """Return the cells (nx, ny) in which the ball's centre cannot be, because it or the shaft would meet the solid."""
    x, y = np.meshgrid(*axes, indexing="ij")
    top = float(solid.bounds[1, 2])
    origins = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, top + 0.01)])
    down = np.tile([0.0, 0.0, -1.0], (x.size, 1))
    faces, rays, places = solid.ray.intersects_id(origins, down, multiple_hits=True, return_locations=True)
    enters = np.where(solid.face_normals[faces, 2] > 0, 1, -1)
    blocked = np.zeros(x.size, dtype=bool)
    for z in np.arange(SENSING_M - TIP_RADIUS_M + 0.5 * LAYER_M, min(top, SENSING_M + SHAFT_M), LAYER_M):
        above = places[:, 2] > z
        depth = np.bincount(rays[above], enters[above], x.size)  # number of shells around the cell
        filled = (depth > 0.5).reshape(x.shape)
        if filled.any():
            ball_m = math.sqrt(max(TIP_RADIUS_M**2 - (z - SENSING_M) ** 2, 0.0))
            radius_m = max(ball_m, SHAFT_RADIUS_M if z > SENSING_M else 0.0)
            blocked |= (scipy.ndimage.distance_transform_edt(~filled) * CELL_M <= radius_m).ravel()
    return blocked.reshape(x.shape)
