import numpy as np
import pytest
from scipy import stats

from glotouch_bt.bench.statistics import bootstrap_mean, wilson


@pytest.mark.parametrize(("k", "n"), [(0, 10), (35, 50), (42, 50), (50, 50), (1, 3)])
def test_wilson_agrees_with_scipy(k: int, n: int) -> None:
    ours = wilson(k, n)
    theirs = stats.binomtest(k, n).proportion_ci(0.95, method="wilson")
    assert ours["lo"] == pytest.approx(theirs.low, abs=1e-12)
    assert ours["hi"] == pytest.approx(theirs.high, abs=1e-12)


def test_wilson_refuses_nonsense() -> None:
    with pytest.raises(ValueError, match="successes"):
        wilson(3, 2)


def test_bootstrap_covers_the_normal_interval() -> None:
    x = np.random.default_rng(1).normal(3.0, 2.0, 400)
    got = bootstrap_mean(x)
    half = 1.96 * x.std() / np.sqrt(x.size)
    assert got["lo"] == pytest.approx(x.mean() - half, abs=0.1 * half)
    assert got["hi"] == pytest.approx(x.mean() + half, abs=0.1 * half)
    assert got == bootstrap_mean(x)
