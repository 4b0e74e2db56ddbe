"""When did the contact begin? Dating an onset in the unfiltered signal.

The filtered signal trips some 7 ms late, and the delay depends on the impact. Walking back in the UNFILTERED one to
where it was still noise is exact to a sample for a stiff contact. Where the signal hardly leaves the noise (a soft
contact, or along the lever where only the force speaks) the ramp with the least squared error is dated instead.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array

SIGMAS = 4.0
"""A sample this many standard deviations above the level before the contact belongs to the contact."""
CLEAR_SIGMAS = 8.0
"""The signal must rise this high for walking back to be trusted."""
SLOW_SAMPLES = 8
"""A rise that takes this many samples from the noise to the trip is a ramp, not an impact."""
RAMP_SHARE = 0.6
"""What leaves the noise at 4 sigma and passes 8 as a ramp begins at half its height; more, and it is a step."""


def onset_index(signal_N: Array, trip: int, sd_N: float, quiet: int = 30) -> float:
    """When the contact began, as a fractional sample index in 0..trip.

    Args:
        signal_N: (n,) unfiltered contact force along the direction it acts in, oldest first.
        trip: Index at which the filtered signal tripped.
        sd_N: Noise of one sample.
        quiet: How many samples before the trip may belong to the contact; the level before it is taken from the rest.
    """
    s = signal_N[: trip + 1]
    before = s[: max(len(s) - quiet, 0)]
    level, spread = 0.0, sd_N
    if len(before) >= 8:
        # Inertia of the hand and vibration lift the level while the arm moves: measure it, but trust it only so far.
        level = float(np.clip(np.median(before), -0.5 * abs(s[-1]), 0.5 * abs(s[-1])))
        spread = max(sd_N, 1.4826 * float(np.median(np.abs(before - np.median(before)))))
    lifted = s - level
    if float(np.max(lifted[-3:])) < CLEAR_SIGMAS * spread:
        return _ramp_start(lifted)
    # The last samples may dip by ringing: walk back from the highest one near the trip.
    top = max(len(s) - 3, 0) + int(np.argmax(lifted[-3:]))
    low = np.nonzero(lifted[:top] < SIGMAS * spread)[0]
    first = int(low[-1]) + 1 if len(low) else 0
    if top - first < SLOW_SAMPLES:
        return max(first - 0.5, 0.0)  # it began between two samples
    # A slow rise was under way before it left the noise: extend its line back to the level.
    t = np.arange(first, top + 1)
    slope, offset = np.polyfit(t, lifted[first : top + 1], 1)
    if slope <= 0 or slope * first + offset > RAMP_SHARE * (slope * top + offset):
        return max(first - 0.5, 0.0)  # no ramp but a step that the filter took its time over
    return float(np.clip(-offset / slope, max(first - quiet, 0), first))


def _ramp_start(s: Array) -> float:
    """Start of the least-squares ramp (zero, then a straight rise) of a noisy signal."""
    n = len(s)
    if n < 6:
        return float(max(n - 1, 0))
    t = np.arange(n)
    starts = np.arange(0, n - 3)
    ramps = np.maximum(t[None, :] - starts[:, None] + 1, 0).astype(np.float64)
    energy = np.sum(ramps**2, axis=1)
    slope = np.maximum(ramps @ s, 0.0) / energy
    return float(starts[int(np.argmax(slope**2 * energy))])
