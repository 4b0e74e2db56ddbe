"""How far a touched thing was pushed, from the way the tip went on past its onset."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array

GIVE_M = 0.2e-3
"""Of the way past the onset so much bends probe and grasp: about 0.2 mm/N at the 1 N that slides an object."""


def pushed(way_m: Array, reaction: Array) -> Array:
    """Where a contact moved what it touched, (2,) m in the frame of its arguments.

    A thing is pushed along the force it gets; the rest of the way the tip slides past it. A wall gets the same answer:
    at most so far.

    Args:
        way_m: (2,) from the tip's place at the onset to where it came to rest.
        reaction: (2,) direction of the force the tip felt; of no length (a touch from above): nothing was pushed.
    """
    norm = float(np.linalg.norm(reaction))
    if norm < 1e-9:
        return np.zeros(2)
    push = -np.asarray(reaction, dtype=np.float64) / norm
    return np.asarray(max(float(way_m @ push) - GIVE_M, 0.0) * push)
