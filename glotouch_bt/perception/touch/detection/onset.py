"""Dating of a contact's onset in the unfiltered signal.

The filtered signal trips about 7 ms late, depending on the impact. For a clear contact, walk back in the
UNFILTERED signal to the noise level: exact to a sample. For a weak one (soft, or along the lever), fit a ramp.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array

SIGMAS = 4.0
"""Minimum rise of a contact sample above the level before it, in standard deviations."""
CLEAR_SIGMAS = 8.0
"""Minimum rise for which walking back is reliable, in standard deviations."""
SLOW_SAMPLES = 8
"""Minimum number of samples from noise to trip of a ramp; a faster rise is an impact."""
RAMP_SHARE = 0.6
"""Maximum ratio of the first to the last value of a ramp: it is 1/2 from 4 to 8 sigma, larger for a filtered step."""


def onset_index(signal_N: Array, trip: int, sd_N: float, quiet: int = 30) -> float:
    """Return the onset of the contact as a fractional sample index in 0..trip.

    Args:
        signal_N: (n,) unfiltered contact force along its direction, oldest first.
        trip: Index at which the filtered signal tripped.
        sd_N: Standard deviation of one sample.
        quiet: Number of samples before the trip that may belong to the contact; earlier ones give the level.
    """
    s = signal_N[: trip + 1]
    before = s[: max(len(s) - quiet, 0)]
    level, spread = 0.0, sd_N
    if len(before) >= 8:
        # Residual inertia and vibration shift the level; measure it, bounded by half of the signal.
        level = float(np.clip(np.median(before), -0.5 * abs(s[-1]), 0.5 * abs(s[-1])))
        spread = max(sd_N, 1.4826 * float(np.median(np.abs(before - np.median(before)))))
    lifted = s - level
    if float(np.max(lifted[-3:])) < CLEAR_SIGMAS * spread:
        return _ramp_start(lifted)
    # The last samples may dip by ringing: walk back from the maximum near the trip.
    top = max(len(s) - 3, 0) + int(np.argmax(lifted[-3:]))
    low = np.nonzero(lifted[:top] < SIGMAS * spread)[0]
    first = int(low[-1]) + 1 if len(low) else 0
    if top - first < SLOW_SAMPLES:
        return max(first - 0.5, 0.0)  # between two samples
    # A slow rise began within the noise: extrapolate its line back to the level.
    t = np.arange(first, top + 1)
    slope, offset = np.polyfit(t, lifted[first : top + 1], 1)
    if slope <= 0 or slope * first + offset > RAMP_SHARE * (slope * top + offset):
        return max(first - 0.5, 0.0)  # a step, detected late by the filter
    return float(np.clip(-offset / slope, max(first - quiet, 0), first))


def _ramp_start(s: Array) -> float:
    """Return the start of the least-squares ramp (zero, then linear) of a noisy signal."""
    n = len(s)
    if n < 6:
        return float(max(n - 1, 0))
    t = np.arange(n)
    starts = np.arange(0, n - 3)
    ramps = np.maximum(t[None, :] - starts[:, None] + 1, 0).astype(np.float64)
    energy = np.sum(ramps**2, axis=1)
    slope = np.maximum(ramps @ s, 0.0) / energy
    return float(starts[int(np.argmax(slope**2 * energy))])
