import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch import estimate_push
from glotouch_bt.perception.touch.outline.pushing import SLIDING_FRICTION


@given(st.floats(0, 0.005), st.floats(-0.005, 0.005), st.floats(0, 6.3), st.floats(0.1, 9.0))
def test_an_object_pushed_by_a_sliding_ball(pushed, slid, angle, size):
    """Coulomb: the ball drags the surface along by the friction angle, and the object moves along the force on it."""
    inwards = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-inwards[1], inwards[0]])
    force = inwards + SLIDING_FRICTION * np.sign(slid) * along
    force /= np.linalg.norm(force)
    got = estimate_push(pushed * force + slid * along, -size * force)
    np.testing.assert_allclose(got, pushed * force, atol=1e-12)


@given(st.floats(-0.005, 0.005), st.floats(-0.005, 0.005), st.floats(0, 6.3))
def test_a_push_is_along_the_force_and_never_longer_than_the_way(x, y, angle):
    reaction, way = np.array([np.cos(angle), np.sin(angle)]), np.array([x, y])
    got = estimate_push(way, reaction)
    assert np.linalg.norm(got) <= np.linalg.norm(way) + 1e-12
    assert got @ reaction <= 1e-12
    assert abs(got[0] * reaction[1] - got[1] * reaction[0]) < 1e-12


def test_a_ball_that_sticks_takes_the_object_along():
    assert estimate_push(np.array([1e-3, 0.0]), np.array([-2.0, 0.0])) == pytest.approx([1e-3, 0.0])


def test_touch_from_above_pushes_nothing():
    assert not estimate_push(np.array([1e-3, 0.0]), np.zeros(2)).any()
