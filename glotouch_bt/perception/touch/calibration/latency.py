"""How late the wrist sensor reports, measured by touching one wall at two speeds.

An onset is placed where the tip was when the sensor reported it, less the latency that is assumed. If the true one is
longer by e, the tip was already v e further: x(v) = x_wall + v e along the approach. Two speeds give e; the mean of
touches from opposite sides would cancel it, but not tell it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array, ParamError


@dataclass(frozen=True)
class LatencyEstimate:
    """The wrist sensor's latency.

    Attributes:
        latency_s: Estimate, s; not below 0.
        sd_s: Its standard deviation, s.
    """

    latency_s: float
    sd_s: float


def latency_from_two_speeds(
    slow_m: Array, fast_m: Array, slow_m_s: float, fast_m_s: float, *, assumed_s: float, sd_m: float
) -> LatencyEstimate:
    """Latency from onsets on one wall at two speeds.

    Args:
        slow_m, fast_m: (k,), (m,) onset places along the approach (growing in the direction of motion), m.
        slow_m_s, fast_m_s: The speed at each touch.
        assumed_s: The latency the onsets were dated with.
        sd_m: Standard deviation of one onset's place, m (dating is good to about a sample: v / 1 kHz and the arm).

    Raises:
        ParamError: No touch at one of the speeds, places that are not finite, or speeds that do not differ.
    """
    slow, fast = np.atleast_1d(np.asarray(slow_m, np.float64)), np.atleast_1d(np.asarray(fast_m, np.float64))
    for name, places in (("slow_m", slow), ("fast_m", fast)):
        if len(places) == 0 or not np.isfinite(places).all():
            raise ParamError(name, places.tolist(), "one or more finite places")
    apart = fast_m_s - slow_m_s
    if not (slow_m_s > 0 and math.isfinite(fast_m_s) and apart > 1e-6):
        raise ParamError("fast_m_s", fast_m_s, f"above slow_m_s = {slow_m_s}, which is positive")
    if not (math.isfinite(sd_m) and sd_m > 0):
        raise ParamError("sd_m", sd_m, "finite and positive")
    error = float(fast.mean() - slow.mean()) / apart
    return LatencyEstimate(max(assumed_s + error, 0.0), sd_m * math.sqrt(1 / len(slow) + 1 / len(fast)) / apart)
