"""Displacement of an object by a contact, from the ball's travel past the onset."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array


def estimate_push(way_m: Array, reaction: Array) -> Array:
    """Return an upper bound of the object's displacement by a contact, (2,) m in the frame of the arguments.

    The object moves along the force on it; the ball slides along the surface for the rest. A fixed wall gives zero,
    but for errors of the probe's compliance.

    Args:
        way_m: (2,) travel of the ball from the onset to rest: the hand's, less the deflection of the probe.
        reaction: (2,) direction of the force on the ball; zero (a touch from above) gives no displacement.
    """
    norm = float(np.linalg.norm(reaction))
    if norm < 1e-9:
        return np.zeros(2)
    push = -np.asarray(reaction, dtype=np.float64) / norm
    return np.asarray(max(float(way_m @ push), 0.0) * push)
