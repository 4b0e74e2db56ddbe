"""Tactile model of a target from its STL: support widths, pad images, contour, nonplanarity.

The tables are over relative yaw phi (hand against mesh), shift l along x_P from the middle of the mesh's footprint, and
height z of the pads' mid-point above the floor.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from glotouch_bt.perception.recognition.model.components import component_outlines
from glotouch_bt.perception.recognition.model.outline import Outline, minimum_rectangle, traced_outline
from glotouch_bt.perception.recognition.model.pads import FINE, Array32, PadSpec, image_feature
from glotouch_bt.perception.recognition.model.raster import mirrored, side_images, window_max
from glotouch_bt.perception.recognition.model.section import TargetSection, section_of
from glotouch_bt.perception.recognition.model.simulated_touches import pooled_images, simulated_statistics
from glotouch_bt.perception.recognition.model.tops import tops_within
from glotouch_bt.robot import Array, ParamError
from glotouch_bt.robot.scene import UPRIGHT, Mesh, Quat

YAWS = 72
"""Number of relative yaws."""
STRIDE = 2
"""Number of raster cells per table cell: 2.3 mm along x_P, 2.7 mm in height."""
MAX_UNEVENNESS_M = 2e-3
"""Maximum unevenness between neighbouring widths; larger differences depend on the pose, not on noise."""
WHOLE_SHARE = 0.2
"""Probability that the probe traces an object of separate parts as a whole. Source: ours."""
_CACHE_SIZE = 64
_cache: dict[tuple[str, PadSpec], TargetModel] = {}


@dataclass(frozen=True, eq=False)
class TargetHypothesis:
    """One way in which the object may stand and be traced.

    Attributes:
        model: Its tables and outline then.
        quat: Rotation (w, x, y, z) from the mesh's file.
        weight: Prior probability.
    """

    model: TargetModel
    quat: Quat
    weight: float


@dataclass(frozen=True, eq=False)
class Certainty:
    """Uncertainty of the tables, each (72, nl, nz), and of the height of an object known only by touch.

    Attributes:
        width_sd_m: Standard deviation of the width, besides that of a measurement.
        width_known: Probability that the table predicts the width; otherwise it is as that of any object.
        image_known: The same of the left pad's image.
        height_sd_m: Standard deviation of the height.
    """

    width_sd_m: Array32
    width_known: Array32
    image_known: Array32
    height_sd_m: float


@dataclass(frozen=True, eq=False)
class TargetModel:
    """Tables of one target for one pad: of a mesh (`from_mesh`), or of what was felt (`touched.touched_model`).

    Attributes:
        name: Name of the mesh, for display.
        digest: Content hash of the mesh.
        pad: The pad.
        phi_rad: (72,) relative yaws, from 0, evenly over the full turn.
        l_m: (nl,) table shifts, symmetric about 0.
        z_m: (nz,) table heights of the pads' mid-point.
        reach_m: (72, nl, nz) maximum coordinate along y_P inside the left pad's window; NaN if empty.
        fine_m: (72, fl, fz) side images, source of the tables (see `raster`); -inf if empty.
        outline: Simulated traces, about `centre_m`.
        components: Simulated traces of the parts that the probe takes for separate objects; empty if there is only one.
        centre_m: (2,) centre of the footprint's minimum-area rectangle, in the mesh's frame O.
        height_m: Top above the floor.
        tops_m: (TOPS,) tops within discs about the middle, from a small disc to the whole object: what a probe may
            take for the top if it traced only a part.
        rho: Nonplanarity predicted for a 10 N touch, median over simulated touches (the paper's rho_M).
        rho_sd: Its deviation over touches (half the 16-84 % range).
        normal_dispersion: 1 - |mean normal| over touched patches, mean over touches (the paper's d_M).
        anisotropy: 1 - short / long of the footprint's minimum-area rectangle (the paper's a_M).
        sides: The sides on which the object may stand, each with a model of its own; empty if only as in its file.
        certainty: How well the tables are known; None if they follow from a mesh. Without a mesh, `fine_m` is empty.
        section: Where the probe's ball can be beside it, about `centre_m`; None if only touch is known of it.
        mesh: The mesh, for predictions that no table holds; None if the target is known only by touch.
    """

    name: str
    digest: str
    pad: PadSpec
    phi_rad: Array
    l_m: Array
    z_m: Array
    reach_m: Array32
    fine_m: Array32
    outline: Outline
    centre_m: Array
    height_m: float
    tops_m: Array
    rho: float
    rho_sd: float
    normal_dispersion: float
    anisotropy: float
    components: tuple[Outline, ...] = ()
    sides: tuple[TargetHypothesis, ...] = ()
    certainty: Certainty | None = None
    section: TargetSection | None = None
    mesh: Mesh | None = None
    _lazy: dict[str, Array32] = field(default_factory=dict, repr=False)

    @classmethod
    def from_mesh(cls, mesh: Mesh, pad: PadSpec | None = None) -> TargetModel:
        """Build the model (about 0.3 s) or get it from the in-memory cache, keyed by content and pad."""
        pad = pad or PadSpec()
        key = (mesh.digest, pad)
        if key not in _cache:
            while len(_cache) >= _CACHE_SIZE:
                del _cache[next(iter(_cache))]
            _cache[key] = _build(mesh, pad)
        return _cache[key]

    @cached_property
    def hypotheses(self) -> tuple[TargetHypothesis, ...]:
        """Hypotheses of the pose of the object and of the part that the probe traced; the weights sum to 1."""
        found: list[TargetHypothesis] = []
        for side in self.sides or (TargetHypothesis(self, UPRIGHT, 1.0),):
            model, components = side.model, side.model.components
            whole = WHOLE_SHARE if components else 1.0
            found.append(replace(side, weight=side.weight * whole))
            for component in components:
                share = side.weight * (1.0 - whole) / len(components)
                found.append(TargetHypothesis(replace(model, outline=component, components=()), side.quat, share))
        return tuple(found)

    def standing(self, quat: Quat) -> TargetModel:
        """Return the model of the object on one of its sides.

        Raises:
            ParamError: It is none of `sides`.
        """
        for h in self.hypotheses:
            if h.quat == quat:
                return h.model
        raise ParamError("quat", quat, "one of the sides of the model")

    @cached_property
    def width_m(self) -> Array32:
        """(72, nl, nz) support width W(l, z; phi), eq. (finite_window_width); NaN if a window is empty.

        Yaws are contiguous in memory.
        """
        return _by_place(self.reach_m + mirrored(self.reach_m))

    @cached_property
    def unevenness_m(self) -> Array32:
        """(72, nl, nz) RMS difference of `width_m` to the six neighbouring cells, at most MAX_UNEVENNESS_M each.

        Yaws are contiguous in memory.
        """
        w, most = self.width_m, np.float32(MAX_UNEVENNESS_M**2)
        total = np.zeros_like(w)
        for axis, wraps in ((0, True), (1, False), (2, False)):
            step = np.diff(w, axis=axis, append=w[:1] if wraps else np.take(w, [-1], axis=axis)) ** 2
            step = np.fmin(step, most)  # fmin: the maximum beside an empty window
            total += step + np.roll(step, 1, axis=axis)
        return _by_place(np.sqrt(total / 6))

    @property
    def narrowest_m(self) -> float:
        """Minimum support width at the middle of the footprint, over all yaws and heights."""
        through = self.width_m[:, len(self.l_m) // 2]
        return float(np.nanmin(through)) if np.isfinite(through).any() else float("inf")

    @cached_property
    def middle_m(self) -> Array32:
        """(72, nl, nz) y_P of the point halfway between the supports, which the jaws centre."""
        return np.float32(0.5) * (self.reach_m - mirrored(self.reach_m))

    @property
    def images(self) -> Array32:
        """(72, nl, nz, 35) image features of the LEFT pad at `pad.force_N`; built at first use (0.4 s)."""
        if "images" not in self._lazy:
            features = image_feature(pooled_images(self.fine_m, STRIDE, self.pad))
            self._lazy["images"] = np.ascontiguousarray(features.transpose(2, 1, 3, 0), dtype=np.float32)
        return self._lazy["images"].transpose(3, 1, 0, 2)

    @property
    def images_by_place(self) -> Array32:
        """The same in storage order (nz, nl, 35, 72): all yaws of a place are compared at once."""
        return self.images.transpose(2, 1, 3, 0)

    def width_at(self, l_m: float, z_m: float, phi_rad: float) -> float:
        """Return one support width by linear interpolation of the table; NaN outside it."""
        n = len(self.phi_rad)
        at = (phi_rad / (2 * np.pi) * n) % n
        i, f = int(at), at % 1.0
        total = 0.0
        for j, w in ((i % n, 1 - f), ((i + 1) % n, f)):
            a, wl = _bracket(self.l_m, l_m)
            b, wz = _bracket(self.z_m, z_m)
            if a < 0 or b < 0:
                return float("nan")
            t = self.width_m[j, a : a + 2, b : b + 2]
            total += w * float(np.array([1 - wl, wl]) @ t.astype(np.float64) @ np.array([1 - wz, wz]))
        return total


def _by_place(table: Array32) -> Array32:
    """Return a table (72, nl, nz) in the memory order (nz, nl, 72)."""
    return np.ascontiguousarray(table.transpose(2, 1, 0)).transpose(2, 1, 0)


def _bracket(grid: Array, x: float) -> tuple[int, float]:
    t = (x - grid[0]) / (grid[1] - grid[0])
    i = int(np.floor(t))
    if i < 0 or i > len(grid) - 1 or (i == len(grid) - 1 and t > i):
        return -1, 0.0
    i = min(i, len(grid) - 2)
    return i, float(t - i)


@dataclass(frozen=True)
class TableAxes:
    """Axes of the tables of a mesh, computed from its footprint and height alone.

    Attributes:
        phi_rad, l_m, z_m: As in `TargetModel`.
        fine_l_m, fine_z_m: Axes of the side images.
        centre_m, height_m: As in `TargetModel`.
        radius_m: Largest distance of a corner of the footprint from its centre.
        anisotropy: As in `TargetModel`.
    """

    phi_rad: Array
    l_m: Array
    z_m: Array
    fine_l_m: Array
    fine_z_m: Array
    centre_m: Array
    height_m: float
    radius_m: float
    anisotropy: float


def table_axes(mesh: Mesh, pad: PadSpec) -> TableAxes:
    """Return the axes of a mesh's tables (a millisecond)."""
    long, short, _, middle = minimum_rectangle(mesh.vertices_m[:, :2])
    footprint = mesh.vertices_m[:, :2] - middle
    radius = float(np.hypot(*np.abs(footprint).max(axis=0)))
    axes = axes_within(radius, float(mesh.vertices_m[:, 2].max()), pad)
    return replace(axes, centre_m=np.asarray(middle), anisotropy=1.0 - short / long)


def axes_within(radius_m: float, top_m: float, pad: PadSpec) -> TableAxes:
    """Return the axes of the tables of an object within a circle about the origin, up to its top."""
    step_l, step_z = pad.window_m[0] / FINE[1], pad.window_m[1] / FINE[0]
    n = int(np.ceil((radius_m + 0.5 * pad.window_m[0]) / (STRIDE * step_l))) * STRIDE + FINE[1] // 2
    fine_l = np.asarray(np.arange(-n, n + 1) * step_l, dtype=np.float64)
    # Heights: pad centres from 8 mm up to 8 mm above the top; the raster extends half a window on both sides.
    centres = np.asarray(np.arange(0.008, top_m + 0.008, STRIDE * step_z), dtype=np.float64)
    half = FINE[0] // 2
    rows = np.arange(STRIDE * (len(centres) - 1) + 1 + 2 * half) - half
    fine_z = np.asarray(centres[0] + rows * step_z, dtype=np.float64)
    phi = np.asarray(np.arange(YAWS) * (2 * np.pi / YAWS), dtype=np.float64)
    h = FINE[1] // 2
    return TableAxes(phi, fine_l[h:-h:STRIDE], centres, fine_l, fine_z, np.zeros(2), top_m, radius_m, 0.0)


def _build(mesh: Mesh, pad: PadSpec) -> TargetModel:
    axes = table_axes(mesh, pad)
    solid = mesh.as_trimesh()
    solid.apply_translation([-axes.centre_m[0], -axes.centre_m[1], 0.0])
    outline = traced_outline(solid)
    fine = side_images(solid, axes.phi_rad, axes.fine_l_m, axes.fine_z_m)
    half, h = FINE[0] // 2, FINE[1] // 2
    reach = window_max(fine)[:, h:-h:STRIDE, half:-half:STRIDE]
    reach = np.where(np.isfinite(reach), reach, np.nan).astype(np.float32)
    rho, rho_sd, dispersion = simulated_statistics(fine, pad)
    for a in (reach, fine):
        a.setflags(write=False)
    return TargetModel(
        mesh.name, mesh.digest, pad, axes.phi_rad, axes.l_m, axes.z_m, reach, fine, outline, axes.centre_m,
        axes.height_m, tops_within(solid, axes.radius_m), rho, rho_sd, dispersion, axes.anisotropy,
        component_outlines(solid), section=section_of(mesh, axes.centre_m), mesh=mesh,
    )  # fmt: skip
