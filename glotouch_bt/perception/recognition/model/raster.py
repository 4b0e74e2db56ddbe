"""Side images of a solid: its reach towards a pad, at every yaw.

`reach[i, j, h]` at relative yaw phi_i is the maximum y of the surface on the line (x = l_j, z = z_h), in the frame with
x axis (cos phi, sin phi) and y axis (sin phi, -cos phi): the planar part of P for a hand at yaw phi relative to the
mesh. This is the image of the left pad (at +y_P); the right pad has that of phi + 180 deg with l reversed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from glotouch_bt.perception.recognition.model.outline import first_hit
from glotouch_bt.perception.recognition.model.pads import FINE, Array32
from glotouch_bt.robot import Array, ParamError

if TYPE_CHECKING:
    import trimesh


def hand_axes(phi_rad: Array) -> tuple[Array, Array]:
    """Return x_P and y_P, each (..., 2), of a down-pointing hand at yaw `phi_rad` (see `Pose.pointing_down`)."""
    c, s = np.cos(phi_rad), np.sin(phi_rad)
    return np.stack([c, s], axis=-1), np.stack([s, -c], axis=-1)


def side_images(solid: trimesh.Trimesh, phi_rad: Array, l_m: Array, z_m: Array) -> Array32:
    """Cast one ray per cell from outside along -y_P.

    Args:
        solid: Watertight mesh; its z axis up.
        phi_rad: (n,) relative yaws.
        l_m: (nl,) coordinates along x_P.
        z_m: (nz,) heights.

    Returns:
        (n, nl, nz) reach in metres; -inf without a hit.

    Raises:
        ParamError: An empty grid.
    """
    if min(len(phi_rad), len(l_m), len(z_m)) == 0:
        raise ParamError("raster grid", (len(phi_rad), len(l_m), len(z_m)), "not empty")
    far = float(np.abs(solid.vertices[:, :2]).max()) * 1.5 + 0.01
    x, y = hand_axes(phi_rad)
    o = np.zeros((len(phi_rad), len(l_m), len(z_m), 3))
    o[..., :2] = x[:, None, None, :] * l_m[None, :, None, None] + far * y[:, None, None, :]
    o[..., 2] = z_m
    d = np.zeros_like(o)
    d[..., :2] = -y[:, None, None, :]
    reach = far - first_hit(solid, o.reshape(-1, 3), d.reshape(-1, 3))
    return np.asarray(reach.reshape(len(phi_rad), len(l_m), len(z_m)), dtype=np.float32)


def window_max(reach: Array32) -> Array32:
    """Return the maximum reach in the pad's window (15 columns x 21 rows) around each cell (separable filter)."""
    a = scipy.ndimage.maximum_filter1d(reach, FINE[1], axis=1, mode="constant", cval=-np.inf)
    return np.asarray(
        scipy.ndimage.maximum_filter1d(a, FINE[0], axis=2, mode="constant", cval=-np.inf), dtype=np.float32
    )


def span(limit: float, n: int) -> Array:
    """Return n evenly spaced values over +-limit; zero for n = 1."""
    return np.linspace(-limit, limit, n) if n > 1 else np.zeros(1)


def mirrored(table: Array32) -> Array32:
    """Return the table of the RIGHT pad: yaw + 180 deg, l reversed. Needs an even number of yaws."""
    return np.roll(table, -(table.shape[0] // 2), axis=0)[:, ::-1]
