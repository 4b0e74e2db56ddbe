"""Which side of an object to probe next, and when it has been probed enough (paper III-E)."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array, ParamError
from glotouch_bt.touch.values import Contour

MIN_CONTACTS, MAX_CONTACTS = 6, 12
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
    return float(np.pi - np.mod(np.pi - middle, 2 * np.pi)), float(gaps[i])


def largest_gap_direction(bearings_rad: Array) -> float:
    """Bearing from the centre, rad in (-pi, pi], in the middle of the largest uncovered interval (paper III-E)."""
    return widest_gap(bearings_rad)[0]


def needs_more(tips_K_m: Array, contour: Contour) -> bool:
    """True while the outline deserves another contact.

    Stops at MAX_CONTACTS; not before MIN_CONTACTS, nor while a wide side is untouched or the fit is poor.

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
    return bool(gap > WIDE_GAP_RAD or contour.rms_m > GOOD_RMS_M)
