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


def onset_index(signal_N: Array, trip: int, sd_N: float, quiet: int = 30) -> int:
    """Index of the first sample that belongs to the contact.

    Args:
        signal_N: (n,) unfiltered contact force along the direction it acts in, oldest first.
        trip: Index at which the filtered signal tripped.
        sd_N: Noise of one sample.
        quiet: How many samples before the trip surely belong to it; the level before the contact is taken from the
        rest.

    Returns:
        0..trip.
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
    low = np.nonzero(lifted < SIGMAS * spread)[0]
    # The last samples may dip below by ringing: walk back from the highest one near the trip.
    top = len(s) - 3 + int(np.argmax(lifted[-3:]))
    low = low[low < top]
    return int(low[-1]) + 1 if len(low) else 0


def _ramp_start(s: Array) -> int:
    """Start of the least-squares ramp (zero, then a straight rise) of a noisy signal."""
    n = len(s)
    if n < 6:
        return max(n - 1, 0)
    t = np.arange(n)
    starts = np.arange(0, n - 3)
    ramps = np.maximum(t[None, :] - starts[:, None] + 1, 0).astype(np.float64)
    energy = np.sum(ramps**2, axis=1)
    slope = np.maximum(ramps @ s, 0.0) / energy
    return int(starts[int(np.argmax(slope**2 * energy))])
