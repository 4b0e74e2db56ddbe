"""Where the probe touched: support function of its section and the combined contact direction (paper III-B)."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, ParamError


def disc_support(radius_m: float, direction: Array) -> float:
    """Support distance of a disc about the origin: its radius, whatever the direction (2,)."""
    return float(radius_m * np.linalg.norm(direction))


def polygon_support(vertices_m: Array, direction: Array) -> float:
    """Support distance max_p d.p of a convex (or any) polygon with vertices (n, 2), in direction (2,), same frame."""
    return float(np.max(np.asarray(vertices_m, dtype=np.float64) @ direction))


def contact_direction(approach: Array, reaction: Array | None) -> Array:
    """Object-facing unit direction (2,): d = (u - r) / |u - r| from approach u and reaction r (eq. contact_direction).

    `reaction=None` is the radial trace probe: d = u. A reaction that does not oppose the approach (u.r >= 0) is no
    evidence about a surface ahead and is left out too: a verified directional consistency is what the paper asks for.

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
    if length < 1e-9 or float(u @ r) >= 0.0:
        return u
    d = u - r / length
    return np.asarray(d / np.linalg.norm(d))


def contact_point(tip_m: Array, tip_radius_m: float, approach: Array, reaction: Array | None = None) -> Array:
    """Contact point (2,) of a ball: x + h(d) d, the support-plane intercept (eq. contact_point).

    Args:
        tip_m: (2,) ball centre at the onset.
        tip_radius_m: Its radius at the height of contact.
        approach: (2,) direction the tip moved in; a vertical approach (no planar part) gives the tip's own place.
        reaction: (2,) direction of the force it felt, or None.
    """
    tip = np.asarray(tip_m, dtype=np.float64)
    if np.linalg.norm(approach) < 1e-6:
        return tip.copy()
    return np.asarray(tip + tip_radius_m * contact_direction(approach, reaction))
