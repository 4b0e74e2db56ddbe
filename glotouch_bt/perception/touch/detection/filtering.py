"""Causal, streaming second-order Butterworth low-pass.

At 30 Hz cut-off and 1 kHz sampling the group delay at DC is sqrt(2) / (2 pi f_c) = 7.5 ms, and white noise is scaled by
sqrt(1.11 f_c / 500) = 0.26 (noise bandwidth of the order-2 Butterworth: pi / (2 sqrt 2) f_c).
"""

from __future__ import annotations

import cmath
import math
from functools import lru_cache

import numpy as np

from glotouch_bt.compiled import compiled
from glotouch_bt.robot import Array, ParamError


@compiled("f8", "f8", "f8", "f8", "f8", "given f8[:, :]", "f8[:, ::1]")
def _filtered(b0: float, b1: float, b2: float, a1: float, a2: float, samples: Array, state: Array) -> Array:
    """Return the filtered samples (n, channels): transposed direct form II; `state` (2, channels) is updated."""
    out = np.zeros(samples.shape)
    for channel in range(samples.shape[1]):
        first, second = state[0, channel], state[1, channel]
        for i in range(len(samples)):
            x = samples[i, channel]
            y = b0 * x + first
            first = b1 * x - a1 * y + second
            second = b2 * x - a2 * y
            out[i, channel] = y
        state[0, channel], state[1, channel] = first, second
    return out


class LowPass:
    """Streaming low-pass of several channels with zero initial state.

    Args:
        channels: Number of columns.
        cutoff_Hz: -3 dB frequency.
        rate_Hz: Sampling rate; the cut-off must lie below half of it.

    Attributes:
        coefficients: b0, b1, b2, a1, a2; see `butterworth`.

    Raises:
        ParamError: A cut-off outside (0, rate / 2).
    """

    def __init__(self, channels: int, cutoff_Hz: float = 30.0, rate_Hz: float = 1000.0) -> None:
        if not 0 < cutoff_Hz < 0.5 * rate_Hz:
            raise ParamError("cutoff_Hz", cutoff_Hz, f"in (0, {0.5 * rate_Hz}), half the sampling rate")
        self.cutoff_Hz, self.rate_Hz = cutoff_Hz, rate_Hz
        self.coefficients = butterworth(cutoff_Hz, rate_Hz)
        self._state: Array = np.zeros((2, channels))

    def __call__(self, block: Array) -> Array:
        """Filter the next block (n, channels); keep the state for the following call."""
        return _filtered(*self.coefficients, block, self._state)

    @property
    def noise_gain(self) -> float:
        """Ratio of the standard deviations of filtered and unfiltered white noise (energy of the impulse response)."""
        return _noise_gain(self.cutoff_Hz, self.rate_Hz)


@lru_cache(maxsize=64)
def butterworth(cutoff_Hz: float, rate_Hz: float) -> tuple[float, float, float, float, float]:
    """Return (b0, b1, b2, a1, a2) of a second-order Butterworth low-pass, by the bilinear transform with prewarping.

    In the order of the operations of `scipy.signal.butter`, whose import alone takes as long as a second of physics.
    """
    warped = 4.0 * math.tan(math.pi * (2.0 * cutoff_Hz / rate_Hz) / 2.0)
    pole = warped * -cmath.exp(-0.25j * math.pi)
    digital = (4.0 + pole) / (4.0 - pole)
    gain = warped**2 * (1.0 / ((4.0 - pole) * (4.0 - pole.conjugate()))).real
    return gain, 2.0 * gain, gain, -2.0 * digital.real, (digital * digital.conjugate()).real


@lru_cache(maxsize=64)
def _noise_gain(cutoff_Hz: float, rate_Hz: float) -> float:
    impulse = np.zeros((int(20 * rate_Hz / cutoff_Hz) + 1, 1))
    impulse[0] = 1.0
    response = _filtered(*butterworth(cutoff_Hz, rate_Hz), impulse, np.zeros((2, 1)))
    return float(np.sqrt(np.sum(np.square(response))))
