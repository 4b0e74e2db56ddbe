"""Stand an object on one of its stable sides."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.errors import BadInput
from glotouch_bt.robot import Array, quat_to_matrix
from glotouch_bt.robot.scene import Mesh, Quat, stances

ALIKE_DEG = 5.0
"""Sides that differ by less are shown as one, the most probable of them. Source: ours."""
MIN_SHARE = 0.02
"""Sides with a smaller probability are not offered. Source: ours."""
STANDS_DEG = 0.5
"""An object that is turned by less than this from a stable side stands on it. Source: ours."""
LEANS_DEG = 20.0
"""An object that leans by less than this from a stable side was meant to stand on it. Source: ours."""


@dataclass(frozen=True)
class Side:
    """A side on which an object stays when it is put down.

    Attributes:
        quat: Rotation (w x y z) of the mesh as in its file that puts it there.
        share: Probability that the object, dropped at random, comes to rest on it.
        tilt_deg: Angle between this direction of up and that of the file.
    """

    quat: Quat
    share: float
    tilt_deg: float


def sides_of(mesh: Mesh) -> tuple[Side, ...]:
    """Return the sides on which an object stands firmly, the most probable first; none if it always rolls."""
    found = [Side(quat, share, _tilt_deg(quat)) for quat, share in stances(mesh)]
    total = sum(s.share for s in found)
    kept: list[Side] = []
    for side in sorted(found, key=lambda s: (s.tilt_deg > STANDS_DEG, -s.share)):
        up = quat_to_matrix(np.array(side.quat))[2]
        near = [k for k in kept if _angle_deg(up, quat_to_matrix(np.array(k.quat))[2]) < ALIKE_DEG]
        if not near and (side.share >= MIN_SHARE * total or side.tilt_deg <= STANDS_DEG):
            kept.append(Side(side.quat, side.share / total, side.tilt_deg))
    return tuple(sorted(kept, key=lambda s: -s.share))


def choose_side(sides: tuple[Side, ...], number: int | None) -> tuple[int | None, str]:
    """Return the index of the side to stand on, or None to stay as in the file, and a note for a person.

    Args:
        sides: Of `sides_of`.
        number: The user's choice, from 1; None: as in the file if it stands so, else the side next to it, or the most
            probable one.

    Raises:
        BadInput: There is no side of this number.
    """
    if number is not None:
        if not 1 <= number <= len(sides):
            raise BadInput(f"has no side {number} (it has {len(sides)} sides on which it stands)")
        return number - 1, f"stood on side {number}, turned by {sides[number - 1].tilt_deg:.0f} deg"
    if not sides:
        return None, "stands firmly on no side: it may roll"
    nearest = min(range(len(sides)), key=lambda i: sides[i].tilt_deg)
    tilt = sides[nearest].tilt_deg
    if tilt <= STANDS_DEG:
        return nearest, ""
    if tilt <= LEANS_DEG:
        return nearest, f"leaned by {tilt:.1f} deg; stood upright on side {nearest + 1}"
    return 0, f"would not stand as in its file; stood on side 1, turned by {sides[0].tilt_deg:.0f} deg"


def _tilt_deg(quat: Quat) -> float:
    return _angle_deg(quat_to_matrix(np.array(quat))[2], np.array([0.0, 0.0, 1.0]))


def _angle_deg(a: Array, b: Array) -> float:
    return math.degrees(math.acos(float(np.clip(a @ b, -1.0, 1.0))))
