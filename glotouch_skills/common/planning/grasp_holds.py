"""Rate the holds of a mesh between two parallel pads, at every yaw, place and height, from the tables of its model.

A good hold has large contacts on both gels, opposite to each other, with the centre of mass near the line between them,
and stays good if the pose is slightly wrong. All coordinates are the hand's: x_P along the
jaws' width and y_P towards the left jaw, from the middle of the mesh's footprint; z above the floor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.recognition.model import FINE, STRIDE, Array32, gel_shift, hand_axes, mirrored
from glotouch_bt.robot import Array, Gripper

if TYPE_CHECKING:
    from glotouch_bt.perception.recognition import TargetModel

Index = npt.NDArray[np.intp]
AREA_SCALE = 0.15
"""Contact area, as a fraction of the pad, that halves a hold's worth."""
LEVER_SCALE_M = 0.015
"""Distance of the pads from the centre of mass that halves a hold's worth: the object would turn about the pads."""
OPPOSITE_M = 0.006
"""Offset between the middles of the two contacts that halves it: closing pads would turn the object."""
STEEP = 0.6
"""Mean slope under a pad that halves it. Source: the least pad friction of conditions/harsh.yaml."""
FINGER_M = 0.001
"""The object may reach this much farther towards a finger than towards its pad: the pad protrudes a little and its gel
yields. An object that reaches farther is held by the fingers, not the pads."""
SHIFTS_M = 0.016
"""Largest distance of a hold from the centre of mass along x_P."""
YAW_STEP = 2
"""Use every second yaw of the tables, which is every 10 degrees."""


@dataclass(frozen=True)
class Holds:
    """All rated holds, as arrays (yaws, shifts, heights).

    Attributes:
        phi_rad: (yaws,) yaw of x_P against the mesh, half a turn.
        l_m: (shifts,) of the pads along x_P.
        z_m: (heights,) of the pads' mid-point.
        worth: 0..1.
        width_m: Aperture of the touching jaws; NaN where one touches nothing.
        middle_m: y_P of the pads' mid-point then.
        opening_m: Smallest aperture, about that middle, with which the descending fingers clear the object.
    """

    phi_rad: Array
    l_m: Array
    z_m: Array
    worth: Array
    width_m: Array
    middle_m: Array
    opening_m: Array


def holds_of(model: TargetModel, com_m: Array, gripper: Gripper, lowest_m: float, force_N: float) -> Holds:
    """Rate all holds; there are none if the table ends below `lowest_m`.

    Args:
        model: Tables of the mesh.
        com_m: (3,) its centre of mass, in the mesh's frame.
        gripper: Pads, fingers and stroke.
        lowest_m: Least height of the pads' mid-point.
        force_N: Jaw force.
    """
    half_turn = len(model.phi_rad) // 2
    yaws = np.arange(0, half_turn, YAW_STEP)
    x = hand_axes(model.phi_rad[yaws])[0]
    com_l = x @ (com_m[:2] - model.centre_m)  # (yaws,) each yaw has its own
    near = np.flatnonzero(np.abs(model.l_m) <= float(np.abs(com_l).max()) + SHIFTS_M)
    heights = np.flatnonzero(model.z_m >= lowest_m - 1e-9)  # above the top, the lower half of the pads holds
    pick = np.ix_(yaws, near, heights)
    l, z = model.l_m[near], model.z_m[heights]
    if not heights.size:
        none = np.zeros((len(yaws), len(near), 0))
        return Holds(model.phi_rad[yaws], l, z, none, none, none, none)
    sides = (model.fine_m, mirrored(model.fine_m))
    width = model.width_m[pick].astype(np.float64)
    middle = model.middle_m[pick].astype(np.float64)
    column = [_column(fine, yaws, near, heights, gripper, model) for fine in sides]
    opening = 2 * np.maximum(column[0] - middle, column[1] + middle)
    on_pads = np.ones_like(opening, dtype=bool)
    for reach, farthest in zip((model.reach_m, mirrored(model.reach_m)), column, strict=True):
        on_pads &= farthest - reach[pick] <= FINGER_M  # false where the pad meets nothing
    possible = np.nonzero(on_pads & (opening <= gripper.stroke_m))
    yaw, shift, height = possible
    felt = [_felt(fine, yaws[yaw], near[shift], heights[height], model, force_N) for fine in sides]
    apart2 = sum((a - b) ** 2 for a, b in zip(felt[0].middle_m, felt[1].middle_m, strict=True))
    along = l[shift] + 0.5 * (felt[0].middle_m[0] + felt[1].middle_m[0]) - com_l[yaw]
    above = z[height] + 0.5 * (felt[0].middle_m[1] + felt[1].middle_m[1]) - com_m[2]
    lever2 = along**2 + (0.5 * above) ** 2
    rated = 1.0 / ((1 + lever2 / LEVER_SCALE_M**2) * (1 + apart2 / OPPOSITE_M**2))
    for side in felt:
        rated = rated * side.area / (side.area + AREA_SCALE) / (1 + (side.slope / STEEP) ** 2)
    worth = np.zeros_like(opening)
    worth[possible] = np.nan_to_num(rated)
    blurred = np.zeros_like(opening)
    blurred[possible] = _blurred(worth)[possible]
    return Holds(model.phi_rad[yaws], l, z, blurred, width, middle, opening)


@dataclass(frozen=True)
class _Felt:
    """Contact of one pad in n holds, arrays (n,); middle_m is (along x_P, up) from the pad's middle."""

    area: Array
    middle_m: tuple[Array, Array]
    slope: Array


def _felt(fine: Array32, yaws: Index, near: Index, heights: Index, model: TargetModel, force_N: float) -> _Felt:
    """Return the contact of a gel in n windows, whose indices in the tables are (n,)."""
    rows, cols = FINE
    windows = np.lib.stride_tricks.sliding_window_view(fine, (cols, rows), axis=(1, 2))
    seen = windows[yaws, STRIDE * near, STRIDE * heights]  # (n, cols, rows)
    top = seen.max(axis=(-2, -1), keepdims=True)
    relative = np.where(np.isfinite(seen), seen - np.where(np.isfinite(top), top, 0.0), -np.inf).astype(np.float32)
    flat = relative.reshape(len(relative), -1)
    step_l, step_z = model.pad.window_m[0] / cols, model.pad.window_m[1] / rows
    depth = np.maximum(flat + gel_shift(flat, step_l * step_z, force_N, model.pad), 0.0).reshape(relative.shape)
    pressed = depth > 0.0
    total = np.maximum(depth.sum(axis=(-2, -1)), 1e-12)
    along = (np.arange(cols) - 0.5 * (cols - 1)) * step_l
    up = (np.arange(rows) - 0.5 * (rows - 1)) * step_z
    slope_l, slope_z = (np.abs(_mean_slope(depth, pressed, axis, step)) for axis, step in ((-2, step_l), (-1, step_z)))
    return _Felt(
        pressed.mean(axis=(-2, -1)),
        ((depth.sum(axis=-1) @ along) / total, (depth.sum(axis=-2) @ up) / total),
        np.hypot(slope_l, slope_z),
    )


def _mean_slope(depth: Array, pressed: npt.NDArray[np.bool_], axis: int, step_m: float) -> Array:
    """Return the mean slope of the contact along one axis of the window."""
    both = np.take(pressed, range(1, pressed.shape[axis]), axis) & np.take(
        pressed, range(pressed.shape[axis] - 1), axis
    )
    rise = np.where(both, np.diff(depth, axis=axis), 0.0).sum(axis=(-2, -1)) / step_m
    return np.asarray(rise / np.maximum(both.sum(axis=(-2, -1)), 1))


def _column(fine: Array32, yaws: Index, near: Index, heights: Index, gripper: Gripper, model: TargetModel) -> Array:
    """Return the object's reach to one side in front of a finger, from its tip upwards, at every hold."""
    rows, cols = FINE
    step_l, step_z = model.pad.window_m[0] / cols, model.pad.window_m[1] / rows
    wide = 2 * int(np.ceil(gripper.finger.half_m[0] / step_l)) + 1
    reach = scipy.ndimage.maximum_filter1d(fine[yaws], wide, axis=1, mode="constant", cval=-np.inf)
    above = np.maximum.accumulate(reach[:, :, ::-1], axis=2)[:, :, ::-1]
    at_l = cols // 2 + STRIDE * near
    at_z = np.maximum(rows // 2 + STRIDE * heights - int(np.ceil(gripper.fingertip_below_P_m / step_z)), 0)
    return np.asarray(above[:, at_l][:, :, at_z], dtype=np.float64)


def _blurred(worth: Array) -> Array:
    """Return the mean over pose errors of up to 10 degrees, 2.3 mm and 2.7 mm to either side."""
    turned = scipy.ndimage.uniform_filter1d(worth, 3, axis=0, mode="nearest")
    return np.asarray(scipy.ndimage.uniform_filter(turned, (1, 3, 3), mode="nearest"))
