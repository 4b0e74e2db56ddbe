"""Where the tool touched: support function of its section and the combined contact direction (paper III-B)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from glotouch_bt.robot import Array, ParamError, frozen_array


class Section(Protocol):
    """The tool's section at the height of contact: a set of points about the tool's reference point."""

    def support_m(self, direction: Array) -> float:
        """Support distance max d.p over the section's points p, for d (2,) written in the section's axes."""
        ...


@dataclass(frozen=True)
class Disc:
    """A ball, or a round shaft, about its centre.

    Attributes:
        radius_m: Its radius.
    """

    radius_m: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius_m) and self.radius_m >= 0):
            raise ParamError("disc.radius_m", self.radius_m, "finite and not negative")

    def support_m(self, direction: Array) -> float:
        """See `Section`: the radius, whatever the direction."""
        return disc_support(self.radius_m, direction)


@dataclass(frozen=True)
class Polygon:
    """A convex section with corners, for instance the outline of two closed fingers.

    Attributes:
        vertices_m: (n, 2), n >= 3, in the section's axes.
    """

    vertices_m: Array

    def __post_init__(self) -> None:
        corners = np.asarray(self.vertices_m, dtype=np.float64)
        if corners.ndim != 2 or len(corners) < 3:
            raise ParamError("polygon.vertices_m", corners.shape, "(n, 2) with n >= 3")
        object.__setattr__(self, "vertices_m", frozen_array("polygon.vertices_m", corners, (len(corners), 2)))

    @classmethod
    def rectangle(cls, half_x_m: float, half_y_m: float) -> Polygon:
        """A rectangle about the reference point."""
        return cls(np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (half_x_m, half_y_m))

    def support_m(self, direction: Array) -> float:
        """See `Section`."""
        return polygon_support(self.vertices_m, direction)


def disc_support(radius_m: float, direction: Array) -> float:
    """Support distance of a disc about the origin: its radius, whatever the direction (2,)."""
    return float(radius_m * np.linalg.norm(direction))


def polygon_support(vertices_m: Array, direction: Array) -> float:
    """Support distance max_p d.p of a convex (or any) polygon with vertices (n, 2), in direction (2,), same frame."""
    return float(np.max(np.asarray(vertices_m, dtype=np.float64) @ direction))


APPROACH_WEIGHT = 0.1
"""Weight of the approach against the reaction's 1 in the combined direction. The paper adds them equally, for probes
that are aimed at the surface. Traced outlines are met at up to 70 degrees from their normal (40 rms), while friction
keeps the reaction within 12 degrees of it (polished ball): inverse variances are as 0.1 to 1."""
SIDEWAYS = 0.2
"""A reaction that pushes along the motion by more than this share is no evidence about a surface ahead; a graze, whose
reaction is at right angles, is."""


def contact_direction(approach: Array, reaction: Array | None, approach_weight: float = APPROACH_WEIGHT) -> Array:
    """Object-facing unit direction (2,): d along w u - r, approach u, reaction r (eq. contact_direction: w = 1).

    `reaction=None` is the radial trace probe: d = u. A reaction that pushes along the motion is left out too: a
    verified directional consistency is what the paper asks for.

    Raises:
        ParamError: The approach has no planar length.
    """
    u = np.asarray(approach, dtype=np.float64)
    norm = float(np.linalg.norm(u))
    if u.shape != (2,) or norm < 1e-9:
        raise ParamError("approach", u.tolist(), "a planar direction (2,) of some length")
    u = u / norm
    if reaction is None:
        return u
    r = np.asarray(reaction, dtype=np.float64)
    length = float(np.linalg.norm(r))
    if length < 1e-9 or float(u @ r) > SIDEWAYS * length:
        return u
    d = approach_weight * u - r / length
    return np.asarray(d / np.linalg.norm(d))


def section_point(
    place_m: Array, section: Section, axes: Array, approach: Array, reaction: Array | None = None
) -> Array:
    """Contact point (2,) of a tool: x + h(d) d, the support-plane intercept (eq. contact_point).

    Args:
        place_m: (2,) the tool's reference point at the onset, in some planar frame.
        section: Its section about that point.
        axes: (2, 2) the section's axes in the planar frame, as columns (may mirror: a hand that points down does).
        approach: (2,) direction the tool moved in; a vertical approach (no planar part) gives the reference itself.
        reaction: (2,) direction of the force it felt, or None.
    """
    place = np.asarray(place_m, dtype=np.float64)
    if np.linalg.norm(approach) < 1e-6:
        return place.copy()
    d = contact_direction(approach, reaction)
    return np.asarray(place + section.support_m(np.asarray(axes, dtype=np.float64).T @ d) * d)


def contact_point(tip_m: Array, tip_radius_m: float, approach: Array, reaction: Array | None = None) -> Array:
    """Contact point (2,) of a ball of `tip_radius_m` whose centre is at tip_m (2,); the rest as in `section_point`."""
    return section_point(tip_m, Disc(tip_radius_m), np.eye(2), approach, reaction)
