import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch import estimate_push


@given(st.floats(-0.005, 0.005), st.floats(-0.005, 0.005), st.floats(0, 6.3), st.floats(0.1, 9.0))
def test_push_is_the_travel_along_the_force(x, y, angle, size):
    reaction = size * np.array([np.cos(angle), np.sin(angle)])
    way = np.array([x, y])
    got = estimate_push(way, reaction)
    along = -way @ reaction / size
    assert np.linalg.norm(got) == pytest.approx(max(along, 0.0), abs=1e-12)
    assert np.linalg.norm(got) <= np.linalg.norm(way) + 1e-12
    assert got @ reaction <= 1e-12


def test_touch_from_above_pushes_nothing():
    assert not estimate_push(np.array([1e-3, 0.0]), np.zeros(2)).any()
