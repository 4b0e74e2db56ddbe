"""Circle and oriented rectangle: distances, normals, their derivatives, rays, and the prior of the parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glotouch_bt.robot import Array

MIN_SIZE_M = 0.005
"""Minimum size of an outline: below what an 85 mm gripper handles, with a margin."""
MAX_SIZE_M = 0.150
"""Maximum size of an outline: above what an 85 mm gripper and the container hold, with a margin."""
TYPICAL_M = 0.060
"""Prior mean of every size (diameter, side). Source: objects are 40-110 mm long, and less across."""
SIZE_SD_M = 0.028
"""Prior standard deviation of every size."""
CORNER_M = 0.002
"""Prior mean of a corner radius."""
CORNER_SD_M = 0.004
"""Prior standard deviation of a corner radius."""
CENTRE_SD_M = 0.025
"""Prior standard deviation of the centre about the point half a typical size behind the contacts."""
CONTACT_SD_M = 0.00045
"""Default standard deviation of a contact: onset scatter of 0.2-0.4 mm, and deviation from a primitive."""
NORMAL_SD_RAD = 0.20
"""Standard deviation of the outward normal about the reaction."""
APPROACH_SD_RAD = 0.60
"""Standard deviation of the outward normal about the reversed approach, where the reaction is unknown."""
FREE_SD_M = 0.001
"""Standard deviation of the penalty on an outline that covers a free position."""
INWARD_COSINE = 0.3
"""Cosine between approach and outward normal above which a contact would have come from inside. Source: ours."""
INWARD_LOSS = 10.0
"""Loss of such a contact, nats. Source: ours."""


@dataclass(frozen=True)
class Touches:
    """Data of a fit, in one planar frame.

    Attributes:
        tips_m: (k, 2) ball centres at the contacts.
        normal_rad: (k,) measured bearing of the outward normal (reaction, else reversed approach).
        normal_sd_rad: (k,) its standard deviation; inf where unknown.
        approach: (k, 2) unit directions of approach; zeros where unknown.
        free_m: (m, 2) contact-free positions of the ball's centre; few, near the outline.
        radius_m: Radius of the ball.
        contact_sd_m: Standard deviation of a ball centre, including the deviation from a plain primitive.
        outliers: Number of first contacts made before the object moved by a common, unknown shift.
    """

    tips_m: Array
    normal_rad: Array
    normal_sd_rad: Array
    approach: Array
    free_m: Array
    radius_m: float
    contact_sd_m: float = CONTACT_SD_M
    outliers: int = 0

    @cached_property
    def current(self) -> Touches:
        """The contacts made since the object moved."""
        s = self.outliers
        tips, normal, sd = self.tips_m[s:], self.normal_rad[s:], self.normal_sd_rad[s:]
        return Touches(tips, normal, sd, self.approach[s:], self.free_m, self.radius_m, self.contact_sd_m)

    @cached_property
    def points_m(self) -> Array:
        """(k + m, 2) contacts, then free positions."""
        return np.concatenate([self.tips_m, self.free_m])

    @cached_property
    def prior_centre_m(self) -> Array:
        """(2,) prior mean of the centre: half a typical size behind the contacts."""
        known = np.isfinite(self.normal_sd_rad)[:, None]
        outward = np.stack([np.cos(self.normal_rad), np.sin(self.normal_rad)], axis=1)
        return np.asarray(
            np.mean(self.tips_m - np.where(known, 0.5 * TYPICAL_M + self.radius_m, 0.0) * outward, axis=0)
        )


@dataclass(frozen=True)
class Geometry:
    """Signed distances (s, k) of points from shapes, their derivatives (s, k, p) by the parameters, of which the first
    two are the negated normal, and bearings (s, k) of the nearest outward normals."""

    distance_m: Array
    by_params: Array
    normal_rad: Array


Shape = Callable[[Array, Array], Geometry]
"""Function from parameters (s, p) and points, (k, 2) or (s, k, 2), to their geometry."""


def circle(params: Array, points_m: Array) -> Geometry:
    """Return the geometry of circles (s, 3) = x, y, radius."""
    dx, dy = points_m[..., 0] - params[:, :1], points_m[..., 1] - params[:, 1:2]
    norm = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9)
    by = np.stack([-dx / norm, -dy / norm, -np.ones_like(norm)], axis=-1)
    return Geometry(norm - params[:, 2:3], by, np.arctan2(dy, dx))


def rectangle(params: Array, points_m: Array) -> Geometry:
    """Return the geometry of rectangles (s, 5) = x, y, yaw, half sides along and across the yaw."""
    g = rounded(np.concatenate([params, np.zeros((len(params), 1))], axis=1), points_m)
    return Geometry(g.distance_m, g.by_params[..., :5], g.normal_rad)


def rounded(params: Array, points_m: Array) -> Geometry:
    """Return the geometry of rectangles with rounded corners (s, 6) = as `rectangle`, then the corner radius.

    A sharp corner would fix an untouched end of a real object with chamfers. The distance is that from the rectangle
    shrunk by the corner radius, minus the radius.
    """
    c, s = np.cos(params[:, 2:3]), np.sin(params[:, 2:3])
    dx, dy = points_m[..., 0] - params[:, :1], points_m[..., 1] - params[:, 1:2]
    x, y = c * dx + s * dy, c * dy - s * dx
    over_x, over_y = np.abs(x) - (params[:, 3:4] - params[:, 5:]), np.abs(y) - (params[:, 4:5] - params[:, 5:])
    out_x, out_y = np.maximum(over_x, 0.0), np.maximum(over_y, 0.0)
    norm = np.sqrt(out_x * out_x + out_y * out_y)
    outside = norm > 1e-12
    size = np.maximum(norm, 1e-12)
    nearer_x = over_x >= over_y
    grad_x = np.where(outside, out_x / size, nearer_x)
    grad_y = np.where(outside, out_y / size, ~nearer_x)
    gx, gy = np.copysign(grad_x, x), np.copysign(grad_y, y)
    by = np.zeros((*norm.shape, 6))
    by[..., 0], by[..., 1], by[..., 2] = s * gy - c * gx, -(s * gx + c * gy), gx * y - gy * x
    by[..., 3], by[..., 4], by[..., 5] = -grad_x, -grad_y, grad_x + grad_y - 1.0
    distance = np.where(outside, norm, np.maximum(over_x, over_y)) - params[:, 5:]
    return Geometry(distance, by, params[:, 2:3] + np.arctan2(gy, gx))


def ray_m(params: Array, grown_m: float, origin_m: Array, unit: Array) -> Array:
    """Return distances (s, n) along unit vectors (n, 2) from inner points, (2,) or (s, 2), to primitives (s, p)
    dilated by `grown_m`. For a ray from outside that misses, return the distance to its nearest point.
    """
    off = origin_m - params[:, :2]
    if params.shape[1] == 3:
        return _far_root(unit[:, 0], unit[:, 1], off[:, :1], off[:, 1:], params[:, 2:] + grown_m)
    c, s = np.cos(params[:, 2:3]), np.sin(params[:, 2:3])
    x, y = c * off[:, :1] + s * off[:, 1:], c * off[:, 1:] - s * off[:, :1]
    ux, uy = c * unit[:, 0] + s * unit[:, 1], c * unit[:, 1] - s * unit[:, 0]
    radius = params[:, 5:] if params.shape[1] == 6 else np.zeros((len(params), 1))
    exit_x = (np.copysign(params[:, 3:4] + grown_m, ux) - x) / np.copysign(np.maximum(np.abs(ux), 1e-9), ux)
    exit_y = (np.copysign(params[:, 4:5] + grown_m, uy) - y) / np.copysign(np.maximum(np.abs(uy), 1e-9), uy)
    t = np.minimum(exit_x, exit_y)
    at_x, at_y = x + t * ux, y + t * uy
    half_x, half_y = params[:, 3:4] - radius, params[:, 4:5] - radius
    rounded_off = np.where(exit_x <= exit_y, np.abs(at_y) > half_y, np.abs(at_x) > half_x)
    to_x, to_y = x - np.copysign(half_x, at_x), y - np.copysign(half_y, at_y)
    return np.asarray(np.where(rounded_off, _far_root(ux, uy, to_x, to_y, radius + grown_m), t))


def _far_root(ux: Array, uy: Array, x: Array, y: Array, radius: Array) -> Array:
    """Return where rays along (ux, uy) from (x, y), relative to a circle's centre, leave the circle."""
    along, across = ux * x + uy * y, ux * y - uy * x
    return np.asarray(np.sqrt(np.maximum(radius**2 - across * across, 0.0)) - along)


def prior(shape: Shape, touches: Touches) -> tuple[Array, Array]:
    """Return prior mean (p,) and standard deviation (p,) of a shape's parameters; the yaw is free (inf)."""
    half, half_sd = 0.5 * TYPICAL_M, 0.5 * SIZE_SD_M
    middle = touches.prior_centre_m
    if shape is circle:
        return np.array([*middle, half]), np.array([CENTRE_SD_M, CENTRE_SD_M, half_sd])
    mean, sd = [*middle, 0.0, half, half], [CENTRE_SD_M, CENTRE_SD_M, np.inf, half_sd, half_sd]
    if shape is rounded:
        mean, sd = [*mean, CORNER_M], [*sd, CORNER_SD_M]
    return np.array(mean), np.array(sd)


def wrapped(angle_rad: Array) -> Array:
    """Wrap angles to (-pi, pi]."""
    return np.asarray(angle_rad + 2 * np.pi * np.floor((np.pi - angle_rad) / (2 * np.pi)))


def clipped(params: Array) -> Array:
    """Clip sizes and corner radii (s, p) to the physical limits, in place."""
    sizes = params[:, 2:3] if params.shape[1] == 3 else params[:, 3:5]
    sizes[:] = np.minimum(np.maximum(sizes, 0.5 * MIN_SIZE_M), 0.5 * MAX_SIZE_M)
    if params.shape[1] == 6:
        params[:, 5] = np.minimum(np.maximum(params[:, 5], 0.0), 0.8 * np.minimum(params[:, 3], params[:, 4]))
    return params
