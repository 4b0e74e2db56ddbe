"""Contacts at a second height, where those at the first leave an object's outline ambiguous.

A section is what the probe feels at one height; the candidate's centre is the lower section's. The upper one is a noisy
sight of it: c2 = c1 + w, where w is how far the middles of sections wander from one height to the other, normal, of
standard deviation WANDER times the difference in height along each axis. The best linear unbiased estimate of c1 from
both (a random-effects combination; DerSimonian and Laird, Control. Clin. Trials 7, 1986) is

    c = c1 + K (c2 - c1),    K = P1 (P1 + P2 + W)^-1,    P = (1 - K) P1

so the second height counts for much where the first says little, and for next to nothing where sections wander farther
than the first is uncertain. The outline moves along with its centre; its size and yaw stay the lower section's.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from glotouch_bt.perception.touch.outline.mixture import OutlineBelief
from glotouch_bt.perception.touch.outline.primitives import CONTACT_SD_M
from glotouch_bt.perception.touch.values import Candidate, Contour, Ring
from glotouch_bt.robot import Array, ParamError

WANDER = 0.10
"""Per axis and height. Of the five objects in the box .09 (3 mm over 25 to 40 mm: figures lean), of twenty random
solids .035."""
UNEXPLAINED_SDS = 2.0
"""Residuals of so many times a contact's scatter are no sensor's: no family explains the contacts."""
UNDECIDED_M = 0.0015
"""The explanations differ so far about the centre (one standard deviation, x and y together)."""


def ambiguous(outline: OutlineBelief) -> str:
    """Why contacts at one height leave the outline open, in a few words; empty if they do not.

    Either no family explains them to within what the sensor scatters, or those that do differ about the centre.
    """
    rms, sd = outline.contour.rms_m, float(np.hypot(*outline.centre_sd_m))
    if rms > UNEXPLAINED_SDS * outline.touches.contact_sd_m:
        return f"the contacts stand {rms * 1e3:.1f} mm off the outline"
    if sd > UNDECIDED_M:
        return f"its centre is known to {sd * 1e3:.1f} mm"
    return ""


def ring_height_m(top_m: float, lower_m: float, share: float, apart_m: float, clear_m: float) -> float | None:
    """Height of the ball's centre for a second ring: that share of the top's, but clear of the top, and apart from the
    lower ring; None if there is no room between the two."""
    low, high = lower_m + apart_m, top_m - clear_m
    return None if high < low else float(np.clip(share * top_m, low, high))


def with_ring(
    candidate: Candidate, lower: OutlineBelief, ring: Ring, upper: OutlineBelief, lower_m: float
) -> Candidate:
    """The candidate with a second ring, and its outline moved to where both heights together have its centre.

    Args:
        candidate: As traced at the lower height.
        lower, upper: What the contacts at either height say, where the object stands now.
        ring: What was felt at the upper one.
        lower_m: The lower height.

    Raises:
        ParamError: The heights are the same.
    """
    apart = ring.height_m - lower_m
    if not math.isfinite(apart) or apart == 0.0:
        raise ParamError("ring.height_m", ring.height_m, f"another height than {lower_m}")
    centre, _ = combined(lower.contour.centre_K_m, _spread(lower), upper.contour.centre_K_m, _spread(upper), abs(apart))
    return replace(candidate, contour=moved(lower.contour, centre - lower.contour.centre_K_m), rings=(ring,))


def combined(lower_m: Array, lower_m2: Array, upper_m: Array, upper_m2: Array, apart_m: float) -> tuple[Array, Array]:
    """Centre (2,) and covariance (2, 2) of the lower section, from both sections' (2,) and (2, 2); see the module."""
    gain = lower_m2 @ np.linalg.inv(lower_m2 + upper_m2 + (WANDER * apart_m) ** 2 * np.eye(2))
    return np.asarray(lower_m + gain @ (upper_m - lower_m)), np.asarray((np.eye(2) - gain) @ lower_m2)


def moved(contour: Contour, by_m: Array) -> Contour:
    """The outline elsewhere; `residuals_m` are as they were."""
    boundary = contour.boundary_K_m + by_m if len(contour.boundary_K_m) else contour.boundary_K_m
    return replace(contour, centre_K_m=contour.centre_K_m + by_m, boundary_K_m=boundary)


def _spread(outline: OutlineBelief) -> Array:
    """(2, 2) m^2 of the centre; residuals larger than the contacts' scatter widen it as much (Birge, Phys. Rev. 40,
    1932)."""
    ratio = max(outline.contour.rms_m / CONTACT_SD_M, 1.0)
    return np.asarray(np.diag((ratio * outline.centre_sd_m) ** 2))
