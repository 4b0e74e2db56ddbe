"""A twin that differs at heights: sums written out, and what tells it from closures that scatter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.recognition.evidence import LayerEvidence
from glotouch_bt.perception.recognition.likelihood.bands import MOVED_M, Residual, log_banded_twin, residual
from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.volumes import Observed, WidthVolumes

P = LikelihoodParams()
NO_BIAS = np.zeros(1)
SEEN = Observed(LayerEvidence(0, 0, 0.05, 1.0, False, 0.0, 0.0, 0.03, (None, None), (1e-4, 1e-4)), 0.0, (0.0, 0.0))


def felt(offs_mm: list[float], height_m: float, scale_m: float = 3e-4) -> list[Residual]:
    return [Residual(np.full((3, 3), 1e-3 * o), scale_m, height_m) for o in offs_mm]


def students_t(z: float) -> float:
    return 2 / (math.pi * math.sqrt(3)) * (1 + z * z / 3) ** -2


@given(st.lists(st.floats(-5, 5), min_size=1, max_size=4), st.lists(st.floats(-5, 5), min_size=1, max_size=4))
def test_against_the_sum_written_out(low: list[float], high: list[float]) -> None:
    def one(off_m: float) -> float:
        return (1 - P.width_outlier) * students_t(off_m / 3e-4) / 3e-4 + P.width_outlier / P.width_range_m

    prior = [students_t(m / P.twin_width_sd_m) for m in MOVED_M]
    total = 0.0
    for offs in (low, high):
        own = math.prod(one(1e-3 * o) for o in offs)
        other = sum(w * math.prod(one(1e-3 * o - m) for o in offs) for w, m in zip(prior, MOVED_M, strict=True))
        total += math.log((1 - P.twin_width) + P.twin_width * other / sum(prior) / own)
    got = log_banded_twin(felt(low, 0.03) + felt(high, 0.05), NO_BIAS, NO_BIAS, P)
    assert got == pytest.approx(total, abs=2e-3)


def test_off_together_is_a_twin_off_apart_is_not() -> None:
    """Three closures 1.5 mm too wide at one height, or one at each of three heights: as many are off."""
    fits = felt([0.0, 0.1, -0.1], 0.02)
    together = fits + felt([1.5, 1.6, 1.4], 0.04) + felt([0.0, -0.1, 0.1], 0.06)
    apart = [r for z in (0.02, 0.04, 0.06) for r in felt([0.0, 1.5, -0.1], z)]
    assert log_banded_twin(together, NO_BIAS, NO_BIAS, P) > 4 + log_banded_twin(apart, NO_BIAS, NO_BIAS, P)
    assert log_banded_twin(apart, NO_BIAS, NO_BIAS, P) < 0 < log_banded_twin(together, NO_BIAS, NO_BIAS, P)
    assert log_banded_twin([], NO_BIAS, NO_BIAS, P) == 0.0


def test_a_bias_that_may_be_is_no_twin() -> None:
    wide = [r for z in (0.02, 0.04, 0.06) for r in felt([0.9, 1.0, 0.9], z)]
    bias = np.array([-1e-3, 0.0, 1e-3])
    assert log_banded_twin(wide, bias, np.log([0.3, 0.4, 0.3]), P) < log_banded_twin(wide, NO_BIAS, NO_BIAS, P) - 3


def test_a_closure_on_a_step_says_nothing() -> None:
    off = np.zeros((72, 7, 3), dtype=np.float32)
    off[:, :, 2] = 0.02
    scale = np.full_like(off, 3e-4)
    volumes = WidthVolumes(off[None], scale[None], np.ones_like(off)[None])
    assert residual(volumes, 0, SEEN, (0, 3, 1)) is None
    inside = residual(volumes, 0, SEEN, (71, 3, 0))
    assert inside is not None
    np.testing.assert_array_equal(inside.off_m, 0.0)
    off[5, 3, 0] = np.nan
    assert residual(volumes, 0, SEEN, (5, 3, 0)) is None
