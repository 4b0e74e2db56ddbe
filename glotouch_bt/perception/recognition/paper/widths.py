"""Support widths of the target for all hypotheses: eq. (finite_window_width), with scale.

A solid of scale s in a fixed window equals s times the unscaled solid in a window scaled by 1/s. The window is an odd
number of raster cells: exact at s = 1, within one cell (1.2 x 1.4 mm) elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.recognition.model import FINE, STRIDE, Array32, PadSpec, TargetModel, mirrored, span
from glotouch_bt.perception.recognition.paper.params import PaperParams
from glotouch_bt.robot import Array

Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
_CACHE_SIZE = 32
_cache: dict[tuple[str, PadSpec, tuple[float, ...]], tuple[WidthTable, ...]] = {}


@dataclass(frozen=True, eq=False)
class WidthTable:
    """Widths of the model at one scale.

    Attributes:
        scale: s.
        l_m, z_m: (nl,), (nz,) coordinates of the SCALED model: along the window from the footprint's middle; height.
        width_m: (yaws, nl, nz) widths; for an empty window the maximum of the neighbours, for interpolation.
        supported: (yaws, nl, nz) True if no window is empty.
        middle_m: (yaws, nl, nz) closing-direction coordinate halfway between the two supports.
    """

    scale: float
    l_m: Array
    z_m: Array
    width_m: Array32
    supported: Mask
    middle_m: Array32


def width_tables(model: TargetModel, scales: tuple[float, ...]) -> tuple[WidthTable, ...]:
    """Return one table per scale, cached in memory by the mesh's content."""
    key = (model.digest, model.pad, scales)
    if key not in _cache:
        while len(_cache) >= _CACHE_SIZE:
            del _cache[next(iter(_cache))]
        _cache[key] = tuple(_table(model, s) for s in scales)
    return _cache[key]


def _table(model: TargetModel, scale: float) -> WidthTable:
    rows, cols = (2 * int(np.floor(0.5 * (n / scale))) + 1 for n in FINE)  # odd
    edge_z, edge_l = (n // 2 for n in FINE)
    reach = scipy.ndimage.maximum_filter1d(model.fine_m, cols, axis=1, mode="constant", cval=-np.inf)
    reach = scipy.ndimage.maximum_filter1d(reach, rows, axis=2, mode="constant", cval=-np.inf)
    reach = reach[:, edge_l:-edge_l:STRIDE, edge_z:-edge_z:STRIDE]
    reach = np.where(np.isfinite(reach), reach, np.nan).astype(np.float32) * np.float32(scale)
    other = mirrored(reach)
    width, middle = reach + other, np.float32(0.5) * (reach - other)
    supported = np.isfinite(width)
    near = scipy.ndimage.maximum_filter(np.where(supported, width, np.float32(0)), size=(1, 3, 3), mode="constant")
    width = np.where(supported, width, near)
    for a in (width, supported, middle):
        a.setflags(write=False)
    return WidthTable(scale, model.l_m * scale, model.z_m * scale, width, supported, middle)


@dataclass(frozen=True)
class Hypotheses:
    """The grid of nuisance poses, flattened to N = scales x yaws x shifts x heights (in this order, C).

    Attributes:
        scale, shift_m, z0_m: (ns,), (nd,), (nz,) values.
        yaws: Number of relative yaws over the full turn; half of them are the scan's reflections.
    """

    scale: Array
    yaws: int
    shift_m: Array
    z0_m: Array

    @classmethod
    def of(cls, model: TargetModel, p: PaperParams) -> Hypotheses:
        """Build the grid from parameters."""
        return cls(np.array(p.scales), len(model.phi_rad), span(p.shift_m, p.shift_steps), span(p.z0_m, p.z0_steps))

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(scales, yaws, shifts, heights)."""
        return len(self.scale), self.yaws, len(self.shift_m), len(self.z0_m)

    @property
    def scale_of_each(self) -> Array32:
        """(N,) scale of every hypothesis."""
        return np.repeat(self.scale, int(np.prod(self.shape[1:]))).astype(np.float32)

    @property
    def off_centre(self) -> Array32:
        """(N,) (delta / max)^2 + (z_0 / max)^2, from 0 to 2."""
        d, z = (np.square(v / max(float(np.abs(v).max()), 1e-9)) for v in (self.shift_m, self.z0_m))
        one = (d[:, None] + z[None, :]).reshape(-1).astype(np.float32)
        return np.tile(one, len(self.scale) * self.yaws)


def predicted_widths(tables: tuple[WidthTable, ...], along_m: float, height_m: Array, grid: Hypotheses) -> Array32:
    """Return widths W(a + delta, z + z_0; s, theta), (H, N), of one sequence for all hypotheses; NaN without support.

    Widths are interpolated; support is that of the nearest table cell.

    Args:
        tables: One per scale of `grid`.
        along_m: a_k.
        height_m: (H,) layer heights.
        grid: The hypotheses.
    """
    _, yaws, nd, nz = grid.shape
    layers = len(height_m)
    out = np.zeros((layers, *grid.shape), dtype=np.float32)
    heights = (height_m[:, None] + grid.z0_m[None, :]).reshape(-1)
    for n, t in enumerate(tables):
        i, f, nearest_l = _positions(t.l_m, along_m + grid.shift_m)
        j, g, nearest_z = _positions(t.z_m, heights)
        columns = t.width_m[:, i] * (1 - f)[:, None] + t.width_m[:, i + 1] * f[:, None]  # (yaws, nd, table heights)
        w = columns[:, :, j] * (1 - g) + columns[:, :, j + 1] * g
        w[~t.supported[:, nearest_l][:, :, nearest_z]] = np.nan
        out[:, n] = w.reshape(yaws, nd, layers, nz).transpose(2, 0, 1, 3)
    return out.reshape(layers, -1)


def _positions(axis: Array, x: Array) -> tuple[Index, Array32, Index]:
    """Return cell and fraction for linear interpolation, and the nearest cell; the fraction is NaN outside the axis."""
    t = (x - axis[0]) / (axis[1] - axis[0])
    i = np.clip(np.floor(t).astype(np.int64), 0, len(axis) - 2)
    f = np.where((t >= -0.5) & (t <= len(axis) - 0.5), np.clip(t - i, 0, 1), np.nan)
    return i, f.astype(np.float32), np.clip(np.rint(t).astype(np.int64), 0, len(axis) - 1)
