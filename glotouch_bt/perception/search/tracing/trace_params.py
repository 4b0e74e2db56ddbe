"""Parameters of tracing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.touch import Contact
from glotouch_bt.robot import Array

Elsewhere = Callable[[tuple[Contact, ...], Contact], bool]
"""Function of the contacts of a trace and a new contact: True if the new one belongs to another, known object."""

Taken = Callable[[Array], npt.NDArray[np.bool_]]
"""Function of places (n, 2) of the ball: (n,) True where it would overlap another, known object."""


def none_taken(places_K_m: Array) -> npt.NDArray[np.bool_]:
    """Return False for all places (n, 2): no other object is known."""
    return np.zeros(len(places_K_m), dtype=np.bool_)


@dataclass(frozen=True, kw_only=True)
class TraceParams:
    """Parameters of tracing. Lengths in metres.

    Attributes:
        clearance_m: Clearance of the ball from the predicted outline.
        margin_sds: Extra clearance, in standard deviations of the prediction.
        widest_margin_m: Maximum extra clearance.
        centre_sd_m: Maximum standard deviation of the centre of a known outline.
        radial_sd_m: Maximum standard deviation of a known outline at any bearing.
        min_contacts, max_contacts: Minimum and maximum number of contacts.
        unfelt_m: Prior standard deviation, per axis, of an unobserved motion since earlier contacts.
        smallest_m: Minimum size of an outline; a smaller one is only a part of the object.
        largest_m: Maximum size of an outline; a larger one is two objects.
        step_m: Maximum travel around the object between probes.
        doubt_m: Standard deviation on the way around above which the ball follows the surface instead.
        along_m: Step along the surface.
        along_reach_m: Depth of the probe after such a step, past the last contact.
        back: Factor on the worth of bearings against the current direction.
        way_m: Travel of a probe in and out, added to the travel to its bearing.
        hop_m: Cost of a hop, as travel; infinite: no hops.
        aside_m: Maximum distance from a hop's goal of a free column where the ball comes down instead.
        keen: Exponent of the standard deviation in a bearing's worth; 2 gives the variance.
        reach_sds: Depth of a probe past the prediction, in standard deviations.
        facing: Minimum cosine between the force on the ball and the direction from the object's centre for the contact
            to belong to the object.
        between_m: Distance from an earlier contact within which a contact always belongs to the object. Source: tuned
            in container_five (gaps of 30 mm); `sharing` divides contacts of objects that touch later.
        same_m: Distance from an earlier contact within which a contact is not new.
        own_m: Distance from the prediction (plus two standard deviations) within which a contact belongs to the object;
            beyond, the evidence for one or two objects decides.
        other: Prior odds that a contact on the way belongs to another object.
        unmodelled_m: Standard deviation of model error far from any contact.
        near_m, far_m: Distances from the nearest contact at which the model error starts and is complete.
        odd_near_m, odd_far_m: The same distances for the free family.
        misses: Maximum number of consecutive probes without a new contact.
        surprise_sds, surprise_m: A contact is surprising if it is farther from the prediction than the sum of these.
        settling: Minimum number of contacts from a surprising one on, before an earlier outline counts as known.
        moves: Maximum number of restarts after an unobserved motion.
        farthest_m: Maximum unobserved motion.
    """

    clearance_m: float = 0.003
    margin_sds: float = 0.7
    widest_margin_m: float = 0.002
    centre_sd_m: float = 0.0010
    radial_sd_m: float = 0.0035
    min_contacts: int = 4
    max_contacts: int = 14
    unfelt_m: float = 0.004
    smallest_m: float = 0.030
    largest_m: float = 0.118
    step_m: float = 0.045
    doubt_m: float = 0.012
    along_m: float = 0.026
    along_reach_m: float = 0.014
    back: float = 0.4
    way_m: float = 0.03
    hop_m: float = math.inf
    aside_m: float = 0.06
    keen: float = 1.0
    reach_sds: float = 2.5
    facing: float = -0.4
    between_m: float = 0.018
    same_m: float = 0.003
    own_m: float = 0.010
    other: float = 0.02
    unmodelled_m: float = 0.006
    near_m: float = 0.024
    far_m: float = 0.042
    odd_near_m: float = 0.024
    odd_far_m: float = 0.042
    misses: int = 5
    surprise_sds: float = 2.0
    surprise_m: float = 0.0015
    settling: int = 3
    moves: int = 2
    farthest_m: float = 0.015
