"""Contact point of a tool: support function of its section and combined contact direction (paper III-B)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from glotouch_bt.robot import Array, ParamError, frozen_array


class Section(Protocol):
    """Section of a tool at the height of contact, about its reference point."""

    def support_m(self, direction: Array) -> float:
        """Return the support function: max d.p over the section's points p, for d (2,) in the section's axes."""


@dataclass(frozen=True)
class Disc:
    """Disc about the reference point: a ball or a round shaft.

    Attributes:
        radius_m: Radius.
    """

    radius_m: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius_m) and self.radius_m >= 0):
            raise ParamError("disc.radius_m", self.radius_m, "finite and not negative")

    def support_m(self, direction: Array) -> float:
        """See `Section`."""
        return float(self.radius_m * np.linalg.norm(direction))


@dataclass(frozen=True)
class Polygon:
    """Convex polygon, for instance the outline of two closed fingers.

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
        """Return a rectangle about the reference point."""
        return cls(np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (half_x_m, half_y_m))

    def support_m(self, direction: Array) -> float:
        """See `Section`."""
        return float(np.max(self.vertices_m @ direction))


APPROACH_WEIGHT = 0.1
"""Weight of the approach in the contact direction, relative to the reaction's 1. The paper uses 1 for probes along the
normal. Here the approach deviates from the normal by 40 degrees rms, the reaction by at most 12 (polished ball); the
inverse variances are as 0.1 to 1."""
MAX_SIDEWAYS = 0.2
"""Maximum component of the unit reaction along the motion; a larger one is no evidence of a surface ahead."""


def contact_direction(approach: Array, reaction: Array | None, approach_weight: float = APPROACH_WEIGHT) -> Array:
    """Return the unit direction (2,) towards the object: d along w u - r for approach u and reaction r.

    Without a reaction, or with one along the motion, d = u (eq. contact_direction of the paper, where w = 1).

    Raises:
        ParamError: The approach is zero in the plane.
    """
    u = np.asarray(approach, dtype=np.float64)
    norm = float(np.linalg.norm(u))
    if u.shape != (2,) or norm < 1e-9:
        raise ParamError("approach", u.tolist(), "a non-zero planar direction (2,)")
    u = u / norm
    if reaction is None:
        return u
    r = np.asarray(reaction, dtype=np.float64)
    length = float(np.linalg.norm(r))
    if length < 1e-9 or float(u @ r) > MAX_SIDEWAYS * length:
        return u
    d = approach_weight * u - r / length
    return np.asarray(d / np.linalg.norm(d))


def section_point(
    place_m: Array, section: Section, axes: Array, approach: Array, reaction: Array | None = None
) -> Array:
    """Return the contact point (2,) of a tool: x + h(d) d, the support-plane intercept (eq. contact_point).

    Args:
        place_m: (2,) reference point of the tool at the onset, in a planar frame.
        section: Section about that point.
        axes: (2, 2) section axes in the planar frame, as columns (mirrored for a hand that points down).
        approach: (2,) direction of motion; a vertical approach (zero in the plane) gives the reference point.
        reaction: (2,) direction of the force on the tool, or None.
    """
    place = np.asarray(place_m, dtype=np.float64)
    if np.linalg.norm(approach) < 1e-6:
        return place.copy()
    d = contact_direction(approach, reaction)
    return np.asarray(place + section.support_m(np.asarray(axes, dtype=np.float64).T @ d) * d)


def contact_point(tip_m: Array, tip_radius_m: float, approach: Array, reaction: Array | None = None) -> Array:
    """Return the contact point (2,) of a ball with centre tip_m (2,); see `section_point`."""
    return section_point(tip_m, Disc(tip_radius_m), np.eye(2), approach, reaction)
