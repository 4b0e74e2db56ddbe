"""When an outline is known well enough, and how the ball goes round meanwhile."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class TraceParams:
    """How an outline is traced. Lengths in metres.

    Attributes:
        clearance_m: Ball to predicted outline while going round.
        margin_sds: So many standard deviations of the prediction are added to the clearance.
        widest_margin_m: No more than this is added.
        centre_sd_m: Enough is known when the centre's standard deviation is below this ...
        radial_sd_m: ... and the outline's nowhere above this.
        min_contacts, max_contacts: Bounds whatever the covariance says.
        unfelt_m: Standard deviation of how far what was known before may have moved unfelt, each way; contacts made
            since say how far it did not.
        smallest_m: What is shorter is a part of an object: not enough is known.
        largest_m: What is longer are two objects.
        step_m: Longest way round before the ball probes again.
        doubt_m: With a deviation above this on the way round, the ball goes along the surface instead ...
        along_m, along_reach_m: ... so far, and then looks for it so far deeper than it was.
        back: How much a bearing counts that lies behind, against the way round so far.
        way_m: Travel that every probe costs beside the way to it (in and out).
        hop_m: What is farther round than `step_m` is reached over the top, which counts as so much travel. Infinite: it
            is not reached at once.
        keen: Power of the deviation when a bearing's worth is weighed against the way: 2 takes the variance.
        reach_sds: A probe goes so many standard deviations past the prediction.
        facing: Cosine between the force on the ball and the direction from the object's middle below which the contact
            is with something else.
        between_m: A contact so near to an earlier one is the object's own: objects stand 30 mm apart, and are pushed a
            few.
        same_m: A contact so near to an earlier one says nothing new.
        own_m: A contact within this (and twice the deviation) of the prediction is the object's own; farther out the
            evidence for one object or two decides.
        other: Odds, before it is looked at, that a contact on the way round belongs to another object.
        unmodelled_m: What no contact is near is not known better than this, whatever the families say that have been
            thought of ...
        near_m, far_m: ... fully so from the second of these distances on, not at all within the first ...
        odd_near_m, odd_far_m: ... and these, as far as it is believed to be neither a circle nor a rectangle.
        misses: So many probes may meet nothing, or be refused, one after another.
        surprise_sds, surprise_m: A contact farther off the prediction than so many standard deviations and this is odd:
            has the object moved without being felt to? ...
        settling: ... So many contacts, the odd one included, are made before enough is known of what was known before.
        moves: An object is begun anew so many times.
        farthest_m: Farther than this no object moves unfelt.
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
