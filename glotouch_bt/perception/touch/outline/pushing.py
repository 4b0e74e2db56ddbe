"""Displacement of an object by a contact, from the tip's travel past the onset."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array

COMPLIANCE_M = 0.2e-3
"""Compliance of probe and grasp: about 0.2 mm/N at the 1 N that slides an object."""


def estimate_push(way_m: Array, reaction: Array) -> Array:
    """Return an upper bound of the object's displacement by a contact, (2,) m in the frame of the arguments.

    The object moves along the force on it; the tip slides along the surface for the rest. A fixed wall gives the same
    estimate.

    Args:
        way_m: (2,) travel of the tip from the onset to rest.
        reaction: (2,) direction of the force on the tip; zero (a touch from above) gives no displacement.
    """
    norm = float(np.linalg.norm(reaction))
    if norm < 1e-9:
        return np.zeros(2)
    push = -np.asarray(reaction, dtype=np.float64) / norm
    return np.asarray(max(float(way_m @ push) - COMPLIANCE_M, 0.0) * push)
