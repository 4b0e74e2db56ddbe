import numpy as np
import pytest

from glotouch_bt.perception.touch import latency_from_two_speeds
from glotouch_bt.robot import ParamError


def test_a_wrong_latency_is_found_and_its_sd_is_honest():
    """Onsets x = wall + v (true - assumed) + noise; 2000 repetitions against the stated standard deviation."""
    rng, slow, fast, sd, true, assumed = np.random.default_rng(0), 0.01, 0.05, 20e-6, 0.008, 0.003
    found = []
    for _ in range(2000):
        x = [0.123 + v * (true - assumed) + sd * rng.standard_normal(n) for v, n in ((slow, 2), (fast, 3))]
        estimate = latency_from_two_speeds(x[0], x[1], slow, fast, assumed_s=assumed, sd_m=sd)
        found.append(estimate.latency_s)
    assert np.mean(found) == pytest.approx(true, abs=4 * estimate.sd_s / np.sqrt(2000))
    assert np.std(found) == pytest.approx(estimate.sd_s, rel=0.08)


def test_it_is_never_negative():
    estimate = latency_from_two_speeds(np.array([1e-3]), np.array([0.0]), 0.01, 0.05, assumed_s=0.003, sd_m=1e-5)
    assert estimate.latency_s == 0.0


@pytest.mark.parametrize(
    "change", [{"slow_m": []}, {"fast_m": [np.nan]}, {"fast_m_s": 0.01}, {"slow_m_s": 0.0}, {"sd_m": 0.0}]
)
def test_bad_input(change):
    given = {"slow_m": [0.0], "fast_m": [0.0], "slow_m_s": 0.01, "fast_m_s": 0.05} | {"assumed_s": 0.003, "sd_m": 1e-5}
    with pytest.raises(ParamError):
        latency_from_two_speeds(**(given | change))
