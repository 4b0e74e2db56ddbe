"""Causal, streaming second-order Butterworth low-pass.

At 30 Hz cut-off and 1 kHz sampling the group delay at DC is sqrt(2) / (2 pi f_c) = 7.5 ms, and white noise is scaled by
sqrt(1.11 f_c / 500) = 0.26 (noise bandwidth of the order-2 Butterworth: pi / (2 sqrt 2) f_c).
"""

from __future__ import annotations

import cmath
import math
from functools import lru_cache

import numpy as np

from glotouch_bt.robot import Array, ParamError

MAX_OPERATOR_SAMPLES = 64
"""Maximum block length, in samples, that is filtered by one matrix product."""


class LowPass:
    """Streaming low-pass of several channels with zero initial state.

    Args:
        channels: Number of columns.
        cutoff_Hz: -3 dB frequency.
        rate_Hz: Sampling rate; the cut-off must lie below half of it.

    Raises:
        ParamError: A cut-off outside (0, rate / 2).
    """

    def __init__(self, channels: int, cutoff_Hz: float = 30.0, rate_Hz: float = 1000.0) -> None:
        if not 0 < cutoff_Hz < 0.5 * rate_Hz:
            raise ParamError("cutoff_Hz", cutoff_Hz, f"in (0, {0.5 * rate_Hz}), half the sampling rate")
        self.cutoff_Hz, self.rate_Hz = cutoff_Hz, rate_Hz
        self._state: Array = np.zeros((2, channels))

    def __call__(self, block: Array) -> Array:
        """Filter the next block (n, channels); keep the state for the following call."""
        n = len(block)
        if n > MAX_OPERATOR_SAMPLES:
            out, self._state = _filtered(butterworth(self.cutoff_Hz, self.rate_Hz), block, self._state)
            return out
        both = _operator(self.cutoff_Hz, self.rate_Hz, n) @ np.concatenate([self._state, block])
        self._state = both[:2]
        return np.asarray(both[2:])

    @property
    def noise_gain(self) -> float:
        """Ratio of the standard deviations of filtered and unfiltered white noise (energy of the impulse response)."""
        return _noise_gain(self.cutoff_Hz, self.rate_Hz)


def butterworth(cutoff_Hz: float, rate_Hz: float) -> tuple[float, float, float, float, float]:
    """Return (b0, b1, b2, a1, a2) of a second-order Butterworth low-pass, by the bilinear transform with prewarping.

    In the order of the operations of `scipy.signal.butter`, whose import alone takes as long as a second of physics.
    """
    warped = 4.0 * math.tan(math.pi * (2.0 * cutoff_Hz / rate_Hz) / 2.0)
    pole = warped * -cmath.exp(-0.25j * math.pi)
    digital = (4.0 + pole) / (4.0 - pole)
    gain = warped**2 * (1.0 / ((4.0 - pole) * (4.0 - pole.conjugate()))).real
    return gain, 2.0 * gain, gain, -2.0 * digital.real, (digital * digital.conjugate()).real


def _filtered(coefficients: tuple[float, ...], samples: Array, state: Array) -> tuple[Array, Array]:
    """Return the filtered samples (n, channels) and the next state (2, channels): transposed direct form II."""
    b0, b1, b2, a1, a2 = coefficients
    first, second = state
    out = np.zeros_like(samples)
    for i, x in enumerate(samples):
        y = b0 * x + first
        first = b1 * x - a1 * y + second
        second = b2 * x - a2 * y
        out[i] = y
    return out, np.stack([first, second])


@lru_cache(maxsize=64)
def _operator(cutoff_Hz: float, rate_Hz: float, n: int) -> Array:
    """Return the matrix (2 + n, 2 + n) from [state; n inputs] to [next state; n outputs].

    Its columns are the responses to unit states and unit inputs. It is ten times faster than a loop over the samples.
    """
    columns = np.eye(2 + n)
    out, state = _filtered(butterworth(cutoff_Hz, rate_Hz), columns[2:], columns[:2])
    return np.concatenate([state, out])


@lru_cache(maxsize=64)
def _noise_gain(cutoff_Hz: float, rate_Hz: float) -> float:
    impulse = np.zeros((int(20 * rate_Hz / cutoff_Hz) + 1, 1))
    impulse[0] = 1.0
    response, _ = _filtered(butterworth(cutoff_Hz, rate_Hz), impulse, np.zeros((2, 1)))
    return float(np.sqrt(np.sum(np.square(response))))
