import numpy as np
import pytest

from glotouch_bt.robot import ParamError
from glotouch_bt.touch import contact_direction, contact_point, disc_support, polygon_support


def test_frictional_force_halves_its_angle():
    """d bisects approach and opposing reaction: for friction angle a off the normal, d is a/2 off."""
    for a in np.deg2rad([0, 6, 13]):
        d = contact_direction(np.array([2.0, 0.0]), np.array([-np.cos(a), np.sin(a)]))
        assert np.arctan2(d[1], d[0]) == pytest.approx(-a / 2)
        assert np.linalg.norm(d) == pytest.approx(1.0)


def test_contact_point_of_a_ball():
    tip = np.array([0.1, 0.2])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.array([0, 1.0])), [0.1, 0.206])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.array([0, 1.0]), np.array([0, -1.0])), [0.1, 0.206])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.array([0, 1.0]), np.array([-1.0, 0])), [0.1, 0.206])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.zeros(2)), tip)


def test_support_of_a_polygon_tends_to_the_disc():
    a = np.linspace(0, 2 * np.pi, 400)
    ring = 0.006 * np.c_[np.cos(a), np.sin(a)]
    for t in np.linspace(0, 6, 7):
        d = np.array([np.cos(t), np.sin(t)])
        assert polygon_support(ring, d) == pytest.approx(disc_support(0.006, d), rel=1e-4)
    square = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1.0]])
    assert polygon_support(square, np.array([0.6, 0.8])) == pytest.approx(1.4)


def test_no_approach_no_direction():
    with pytest.raises(ParamError):
        contact_direction(np.zeros(2), None)
