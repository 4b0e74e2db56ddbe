"""Which side of an object to probe next, and when it has been probed enough (paper III-E)."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.touch.values import Contour
from glotouch_bt.robot import Array, ParamError

MIN_CONTACTS, MIN_BOX_CONTACTS, MAX_CONTACTS = 6, 8, 12
"""A rectangle has five parameters: with six contacts nearly anything fits one."""
MAX_POOR_CONTACTS = 10
"""An outline that is neither round nor a box by then will not become one."""
GOOD_RMS_M = 0.0015
"""A fit this good needs no more contacts: three times the contact scatter of a nominal sensor."""
WIDE_GAP_RAD = np.deg2rad(100.0)
"""No side of the object may stay untouched over more than this."""


def widest_gap(bearings_rad: Array) -> tuple[float, float]:
    """(middle, width), rad, of the widest interval between neighbouring bearings (k,); middle in (-pi, pi].

    Raises:
        ParamError: No bearing given.
    """
    b = np.sort(np.mod(np.asarray(bearings_rad, dtype=np.float64).ravel(), 2 * np.pi))
    if len(b) == 0:
        raise ParamError("bearings_rad", 0, "at least one bearing")
    gaps = np.diff(np.append(b, b[0] + 2 * np.pi))
    i = int(np.argmax(np.round(gaps, 9)))
    middle = b[i] + 0.5 * gaps[i]
    return float(_wrap(np.asarray(middle))), float(gaps[i])


def largest_gap_direction(bearings_rad: Array) -> float:
    """Bearing from the centre, rad in (-pi, pi], in the middle of the largest uncovered interval (paper III-E)."""
    return widest_gap(bearings_rad)[0]


def next_direction(tips_K_m: Array, contour: Contour, blocked_rad: Array | None = None) -> float:
    """Bearing from the contour's centre at which the next contact says most, rad in (-pi, pi].

    The middle of the largest uncovered interval (paper III-E); but once the outline is a box, a face that no contact
    supports comes first: its position is a guess, and the box's centre with it.

    Args:
        tips_K_m: (k, 2) ball centres at the contacts.
        contour: The fit to them.
        blocked_rad: Bearings that were tried and cannot be reached.
    """
    tips = np.asarray(tips_K_m, dtype=np.float64)[:, :2]
    offset = tips - contour.centre_K_m
    blocked = np.zeros(0) if blocked_rad is None else np.asarray(blocked_rad, dtype=np.float64).ravel()
    taken = np.concatenate([np.arctan2(offset[:, 1], offset[:, 0]), blocked])
    for bearing in _bare_faces(tips, contour):
        if len(blocked) == 0 or np.min(np.abs(_wrap(blocked - bearing))) > np.deg2rad(15.0):
            return bearing
    return largest_gap_direction(taken)


def needs_more(tips_K_m: Array, contour: Contour) -> bool:
    """True while the outline deserves another contact.

    Stops at MAX_CONTACTS; not before MIN_CONTACTS (MIN_BOX_CONTACTS for a box), nor while a wide side or a face of a
    box is untouched, or the fit is poor.

    Args:
        tips_K_m: (k, 2) ball centres at the contacts.
        contour: The fit to them.
    """
    tips = np.asarray(tips_K_m, dtype=np.float64)
    if len(tips) >= MAX_CONTACTS:
        return False
    if len(tips) < MIN_CONTACTS:
        return True
    offset = tips - contour.centre_K_m
    _, gap = widest_gap(np.arctan2(offset[:, 1], offset[:, 0]))
    if gap > WIDE_GAP_RAD or (contour.rms_m > GOOD_RMS_M and len(tips) < MAX_POOR_CONTACTS):
        return True
    return contour.kind == "box" and (len(tips) < MIN_BOX_CONTACTS or len(_bare_faces(tips, contour)) > 0)


def _bare_faces(tips: Array, contour: Contour) -> list[float]:
    """Bearings of a box's faces that no ball (k, 2) has touched: beyond the face's plane and beside no other face."""
    if contour.kind != "box":
        return []
    c, s = np.cos(contour.yaw_rad), np.sin(contour.yaw_rad)
    local = (tips - contour.centre_K_m) @ np.array([[c, -s], [s, c]])
    over = np.abs(local) - 0.5 * np.asarray(contour.size_m)
    axis = np.argmax(over, axis=1)
    turn = np.array([[0.0, np.pi], [0.5 * np.pi, -0.5 * np.pi]])
    bare = []
    for i in (0, 1):
        for j, sign in enumerate((1.0, -1.0)):
            if not np.any((axis == i) & (np.sign(local[:, i]) == sign)):
                bare.append(float(_wrap(np.array(contour.yaw_rad + turn[i, j]))))
    return bare


def _wrap(angle: Array) -> Array:
    return np.asarray(np.pi - np.mod(np.pi - angle, 2 * np.pi))
