"""Outlines of a solid's lower part: what the probe would trace, as a circle or an oriented rectangle.

The model's own section is fitted in the same way as the probe's contacts, so that the two can be compared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

from glotouch_bt.robot import Array, ParamError

SENSING_M = (0.012, 0.022)
"""Heights the probe's ball (radius 6 mm) feels when its centre is at about 17 mm above the floor."""
BOX_RMS_M = 0.0015
"""Circle residual at which round and box are equally likely."""


@dataclass(frozen=True)
class Outline:
    """What fitting an outline gives, in the frame of its points.

    Attributes:
        circle_centre_m: (2,) of the circle.
        diameter_m: Of the circle.
        circle_rms_m: Its residual.
        box_centre_m: (2,) of the rectangle.
        size_m: (long, short) of the rectangle.
        yaw_rad: Direction of its long side, in [-pi/2, pi/2).
        box_rms_m: Its residual.
    """

    circle_centre_m: Array
    diameter_m: float
    circle_rms_m: float
    box_centre_m: Array
    size_m: tuple[float, float]
    yaw_rad: float
    box_rms_m: float

    @property
    def p_box(self) -> float:
        """Probability that a tracer calls it a box: logistic in the circle's residual (0.5 at BOX_RMS_M)."""
        return 1.0 / (1.0 + math.exp(-(self.circle_rms_m - BOX_RMS_M) / (0.2 * BOX_RMS_M)))


def fit_outline(points_m: Array) -> Outline:
    """Fit a circle (soft-l1, eq. (circle_fit)) and a rectangle (point to nearest edge) to outline points (k, 2).

    Raises:
        ParamError: Fewer than 5 points, or all on one line.
    """
    p = np.asarray(points_m, dtype=np.float64)
    if len(p) < 5 or np.linalg.matrix_rank(p - p.mean(axis=0), tol=1e-6) < 2:
        raise ParamError("points_m", len(p), "at least 5 points that are not on one line")
    # Algebraic circle (Kasa) as the start.
    a = np.column_stack([2 * p, np.ones(len(p))])
    s = np.linalg.lstsq(a, (p**2).sum(axis=1), rcond=None)[0]
    r0 = math.sqrt(max(s[2] + s[0] ** 2 + s[1] ** 2, 1e-8))

    def circle(v: Array) -> Array:
        return np.asarray(np.hypot(p[:, 0] - v[0], p[:, 1] - v[1]) - v[2])

    c = least_squares(circle, [s[0], s[1], r0], loss="soft_l1", f_scale=1e-3, max_nfev=30)
    start_long, start_short, yaw, centre = minimum_rectangle(p)

    def box(v: Array) -> Array:
        return box_distance(p, v[:2], v[2], v[3], v[4])

    best = None
    for turn in (0.0, math.pi / 4):
        b = least_squares(
            box,
            [centre[0], centre[1], start_long, start_short, yaw + turn],
            loss="soft_l1",
            f_scale=1e-3,
            max_nfev=30,
            x_scale=[0.01, 0.01, 0.02, 0.02, 0.2],
        )
        if best is None or b.cost < best.cost:
            best = b
    assert best is not None
    v = best.x
    long, short, yaw = float(abs(v[2])), float(abs(v[3])), float(v[4])
    if short > long:
        long, short, yaw = short, long, yaw + math.pi / 2
    yaw = (yaw + math.pi / 2) % math.pi - math.pi / 2
    rms_c = float(np.sqrt(np.mean(circle(c.x) ** 2)))
    rms_b = float(np.sqrt(np.mean(box(v) ** 2)))
    return Outline(c.x[:2], 2 * float(abs(c.x[2])), rms_c, v[:2], (long, short), yaw, rms_b)


def box_distance(p: Array, centre: Array, long: float, short: float, yaw: float) -> Array:
    """Signed distance (k,) of points (k, 2) from a rectangle's outline, outside positive."""
    c, s = math.cos(yaw), math.sin(yaw)
    d = p - centre
    q = np.abs(np.column_stack([c * d[:, 0] + s * d[:, 1], -s * d[:, 0] + c * d[:, 1]]))
    q = q - 0.5 * np.abs([long, short])
    outside = np.hypot(np.maximum(q[:, 0], 0), np.maximum(q[:, 1], 0))
    return np.asarray(outside + np.minimum(np.maximum(q[:, 0], q[:, 1]), 0))


def minimum_rectangle(points_m: Array) -> tuple[float, float, float, Array]:
    """(long, short, yaw of the long side, centre (2,)) of the rectangle of least area round points (k, 2)."""
    hull = points_m[ConvexHull(points_m).vertices]
    edges = np.roll(hull, -1, axis=0) - hull
    angles = np.arctan2(edges[:, 1], edges[:, 0])
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    u, v = c * hull[:, 0] + s * hull[:, 1], -s * hull[:, 0] + c * hull[:, 1]
    du, dv = np.ptp(u, axis=1), np.ptp(v, axis=1)
    i = int(np.argmin(du * dv))
    mu, mv = 0.5 * (u[i].max() + u[i].min()), 0.5 * (v[i].max() + v[i].min())
    yaw = float(angles[i])
    centre = np.array([math.cos(yaw) * mu - math.sin(yaw) * mv, math.sin(yaw) * mu + math.cos(yaw) * mv])
    if dv[i] > du[i]:
        return float(dv[i]), float(du[i]), yaw + math.pi / 2, centre
    return float(du[i]), float(dv[i]), yaw, centre


def traced_outline(
    solid: trimesh.Trimesh, directions: int = 24, tip_radius_m: float = 0.006, start_rad: float = 0.0
) -> Array:
    """Points (k, 2) a probe would feel that comes from `directions` evenly spread sides towards the section's middle.

    The outermost surface at SENSING heights along each direction, bridged over dents narrower than the ball by taking the
    largest reach of a thin bundle of rays. An object lower than the band is felt at its half height.
    """
    top = float(solid.vertices[:, 2].max())
    z = np.clip(np.linspace(*SENSING_M, 5), 0.1 * top, 0.6 * top if top < SENSING_M[1] else 0.98 * top)
    middle = _section_middle(solid, z)
    angle = start_rad + np.linspace(0, 2 * np.pi, directions, endpoint=False)
    u = np.column_stack([np.cos(angle), np.sin(angle)])
    side = np.column_stack([-u[:, 1], u[:, 0]])
    across = np.array([-0.5, 0.0, 0.5]) * tip_radius_m
    far = float(np.abs(solid.vertices[:, :2]).max()) * 3 + 0.02
    o = np.zeros((directions, len(across), len(z), 3))
    o[..., :2] = middle + far * u[:, None, None, :] + across[None, :, None, None] * side[:, None, None, :]
    o[..., 2] = z
    d = np.zeros_like(o)
    d[..., :2] = -u[:, None, None, :]
    flat_o, flat_d = o.reshape(-1, 3), d.reshape(-1, 3)
    hit = solid.ray.intersects_first(flat_o, flat_d)
    n, p = solid.face_normals[hit], solid.triangles[hit, 0]
    along = np.einsum("ij,ij->i", n, flat_d)
    t = np.einsum("ij,ij->i", n, p - flat_o) / np.where(np.abs(along) < 1e-9, np.nan, along)
    sag = tip_radius_m - np.sqrt(tip_radius_m**2 - across**2)  # the ball's side reaches less far than its nose
    reach = np.where(hit >= 0, far - t, np.nan).reshape(directions, len(across), len(z)) - sag[None, :, None]
    reach = np.where(np.isfinite(reach), reach, -np.inf).max(axis=(1, 2))
    ok = np.isfinite(reach)
    return np.asarray(middle + reach[ok, None] * u[ok])


def _section_middle(solid: trimesh.Trimesh, z: Array) -> Array:
    """Middle of the smallest rectangle round the section at the heights `z`."""
    points = []
    for h in z[[0, len(z) // 2, -1]]:
        lines = trimesh.intersections.mesh_plane(solid, plane_normal=[0, 0, 1], plane_origin=[0, 0, float(h)])
        if len(lines):
            points.append(lines.reshape(-1, 3)[:, :2])
    cloud = np.concatenate(points) if points else np.asarray(solid.vertices[:, :2])
    return minimum_rectangle(cloud)[3]
