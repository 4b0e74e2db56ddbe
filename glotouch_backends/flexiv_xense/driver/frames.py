"""Conversion of the vendors' frames, signs and units to ours; no other file converts.

Ours (robot.observation): B arm base, E flange = wrist sensor S, P pads' mid-point. A wrench is what the hand FEELS from
its environment, force N then torque Nm, written in S about S's origin.

Flexiv: "world" is the arm's base B. The TCP is P, as registered with the tool. The external wrench is applied ON the
TCP and written in the TCP frame about its origin; it has our sign: a tool pressed on a table feels +z of the world.
Quaternions are w x y z in both.

Xense: millimetres, mm/s, N; depth maps in millimetres, positive when the gel is indented; images blue, green, red.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
MM = 1e-3


def rotation(quat: npt.ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a unit quaternion w x y z."""
    w, x, y, z = (float(v) for v in np.asarray(quat, dtype=np.float64))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def twist_between(before: npt.ArrayLike, after: npt.ArrayLike, duration_s: float) -> Array:
    """Return the mean twist (6,) between two poses (7,) x y z qw qx qy qz, linear m/s and angular rad/s, written in B.

    The angular part is the rotation vector to first order; poses a few milliseconds apart differ by little.
    """
    a, b = np.asarray(before, dtype=np.float64), np.asarray(after, dtype=np.float64)
    turned = a[3] * b[4:] - b[3] * a[4:] - np.cross(b[4:], a[4:])  # vector part of q_b times the conjugate of q_a
    same = math.copysign(2.0, a[3:] @ b[3:])  # q and -q are the same rotation
    return np.concatenate([b[:3] - a[:3], same * turned]) / duration_s


def wrench_map(pose_E_P: npt.ArrayLike) -> Array:
    """Return the matrix (6, 6) that transforms a wrench in P about P to S about S.

    With R the rotation and p the origin of P in S: f_S = R f_P, t_S = R t_P + p x f_S (moving a wrench's reference
    point; Lynch and Park, Modern Robotics, 3.4).

    Args:
        pose_E_P: (7,) x y z qw qx qy qz.
    """
    pose = np.asarray(pose_E_P, dtype=np.float64)
    r = rotation(pose[3:])
    x, y, z = pose[:3].tolist()
    lever = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = r
    out[3:, :3] = lever @ r
    return out


def payload_on_tool(
    mass_kg: float, com_E_m: npt.ArrayLike, payload_kg: float, com_P_m: npt.ArrayLike, pose_E_P: npt.ArrayLike
) -> tuple[float, list[float]]:
    """Return mass and centre of mass (3,) in E of tool and payload together; `com_P_m` is the payload's in P."""
    pose = np.asarray(pose_E_P, dtype=np.float64)
    com = rotation(pose[3:]) @ np.asarray(com_P_m, dtype=np.float64) + pose[:3]
    mass = mass_kg + payload_kg
    both = mass_kg * np.asarray(com_E_m, dtype=np.float64) + payload_kg * com
    return mass, cast("list[float]", (both / mass).tolist() if mass > 0.0 else [0.0, 0.0, 0.0])


def depth_map_m(depth_mm: npt.ArrayLike, shape: tuple[int, int], mirrored: bool) -> Array:
    """Return a depth map in metres of shape (rows, columns): each cell is the mean of its live pixels.

    Args:
        depth_mm: (h, w), rows from the flange to the fingertip.
        shape: Not larger than (h, w).
        mirrored: True if its columns run along -x_P.
    """
    image = np.asarray(depth_mm)
    if mirrored:
        image = image[:, ::-1]
    (h, w), (m, n) = image.shape, shape
    if h % m or w % n:  # crop the remainder, less than one cell
        image = image[: h - h % m, : w - w % n]
    cells = image.reshape(m, h // m, n, w // n)
    mean: Array = cells.mean(axis=(1, 3), dtype=np.float64)
    for i, j in np.argwhere(~np.isfinite(mean)):
        cell = cells[i, :, j]
        good = np.isfinite(cell)
        mean[i, j] = cell[good].mean(dtype=np.float64) if good.any() else np.nan
    return MM * mean


def gel_image(rectified: npt.ArrayLike, shape: tuple[int, int], mirrored: bool) -> npt.NDArray[np.uint8]:
    """Return a gel image (rows, columns, 3), red, green, blue: each pixel is the mean of a cell of the vendor's image.

    Args:
        rectified: (h, w, 3) uint8 blue, green, red, rows from the flange to the fingertip.
        shape: (rows, columns), not larger than (h, w).
        mirrored: True if its columns run along -x_P.
    """
    image = np.asarray(rectified)[:, :, ::-1]
    if mirrored:
        image = image[:, ::-1]
    (h, w, _), (m, n) = image.shape, shape
    cells = image[: h - h % m, : w - w % n].reshape(m, h // m, n, w // n, 3)  # crops less than one cell
    mean: Array = cells.mean(axis=(1, 3), dtype=np.float64)
    return np.rint(mean).astype(np.uint8)
