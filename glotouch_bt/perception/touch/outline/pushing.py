"""Displacement of an object by a contact, from the ball's travel past the onset."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array

SLIDING_FRICTION = 0.2
"""Friction of the ball that slides along a surface. Source: ours, polished steel; 12 degrees, as in `localisation`."""


def estimate_push(way_m: Array, reaction: Array) -> Array:
    """Estimate the object's displacement by a contact, (2,) m in the frame of the arguments.

    The object moves along the force d on it, the ball slides along the surface t for the rest: w = s d + r t. Sliding
    turns the force from the normal towards t by the friction angle, d . t = sin(a) and |d x t| = cos(a), so that
    s = w . d - tan(a) |w x d|. A fixed wall gives zero, but for errors of compliance and friction.

    Args:
        way_m: (2,) travel of the ball from the onset to rest: the hand's, less the deflection of the probe.
        reaction: (2,) direction of the force on the ball; zero (a touch from above) gives no displacement.
    """
    norm = float(np.linalg.norm(reaction))
    if norm < 1e-9:
        return np.zeros(2)
    push = -np.asarray(reaction, dtype=np.float64) / norm
    slide_m = abs(float(way_m[0] * push[1] - way_m[1] * push[0]))
    return np.asarray(max(float(way_m @ push) - SLIDING_FRICTION * slide_m, 0.0) * push)
