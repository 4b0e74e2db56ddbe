import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from glotouch_bt.perception.touch import LowPass, fit_baseline
from glotouch_bt.robot import ParamError


def test_blocks_of_any_size_equal_one_pass():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(500, 6))
    want = sosfilt(butter(2, 30.0, fs=1000.0, output="sos"), x, axis=0)
    low_pass, at, got = LowPass(6), 0, []
    while at < len(x):
        n = int(rng.integers(1, 14))
        got.append(low_pass(x[at : at + n]))
        at += n
    np.testing.assert_allclose(np.vstack(got), want, atol=1e-12)


def test_group_delay_and_noise_gain_are_as_documented():
    """A slow ramp lags by the group delay of 7.5 ms; white noise shrinks by sqrt(1.11 fc / 500)."""
    low_pass = LowPass(1)
    t = np.arange(4000) * 1e-3
    late = t[-1] - low_pass(t[:, None])[-1, 0]
    assert late == pytest.approx(0.0075, abs=1e-4)
    noise = LowPass(1)(np.random.default_rng(0).normal(size=(200000, 1)))
    assert low_pass.noise_gain == pytest.approx(float(np.std(noise)), rel=0.02)
    assert low_pass.noise_gain == pytest.approx(np.sqrt(1.11 * 30 / 500), rel=0.02)


def test_cutoff_must_be_below_nyquist():
    with pytest.raises(ParamError, match="cutoff_Hz"):
        LowPass(6, 600.0)


def test_baseline_ignores_outliers():
    rng = np.random.default_rng(0)
    w = 0.05 * rng.normal(size=(400, 6)) + np.arange(6)
    w[::20] += 30.0
    baseline = fit_baseline(w)
    np.testing.assert_allclose(baseline.median, np.arange(6), atol=0.02)
    np.testing.assert_allclose(baseline.sd, 0.05, rtol=0.2)


@pytest.mark.parametrize("bad", [np.zeros((2, 6)), np.zeros((9, 3)), np.full((9, 6), np.nan)])
def test_baseline_refuses_invalid_wrenches(bad):
    with pytest.raises(ParamError, match="wrench_S"):
        fit_baseline(bad)
