import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch import contact_direction, contact_point
from glotouch_bt.perception.touch.detection.localisation import Disc, Polygon, section_point
from glotouch_bt.robot import ParamError


def test_equal_weights_halve_the_friction_angle():
    """d bisects approach and opposing reaction: for friction angle a off the normal, d is a/2 off."""
    for a in np.deg2rad([0, 6, 13]):
        d = contact_direction(np.array([2.0, 0.0]), np.array([-np.cos(a), np.sin(a)]), approach_weight=1.0)
        assert np.arctan2(d[1], d[0]) == pytest.approx(-a / 2)
        assert np.linalg.norm(d) == pytest.approx(1.0)


@given(approach=st.floats(-1.2, 1.2), mu=st.floats(0.0, 0.2))
def test_slanted_approach_with_friction_shifts_the_contact_point_little(approach: float, mu: float) -> None:
    """A ball slides along a wall x = r: its force is off the normal by the friction angle, against the sliding."""
    u = np.array([np.cos(approach), np.sin(approach)])
    angle = min(np.arctan(mu), abs(approach))
    r = -np.array([np.cos(angle), np.copysign(np.sin(angle), approach)])
    point = contact_point(np.zeros(2), 0.006, u, r)
    assert 0.006 - point[0] <= 0.00025


def test_grazing_contact_locates_the_surface() -> None:
    """Moving along a wall at -y: the reaction is at right angles to the motion."""
    np.testing.assert_allclose(
        contact_point(np.zeros(2), 0.006, np.array([1.0, 0.0]), np.array([0.02, 1.0])), [0, -0.006], atol=7e-4
    )


def test_reaction_along_the_motion_is_ignored() -> None:
    np.testing.assert_allclose(
        contact_point(np.zeros(2), 0.006, np.array([1.0, 0.0]), np.array([0.5, 1.0])), [0.006, 0], atol=1e-12
    )


def test_contact_point_of_a_ball():
    tip = np.array([0.1, 0.2])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.array([0, 1.0])), [0.1, 0.206])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.array([0, 1.0]), np.array([0, -1.0])), [0.1, 0.206])
    np.testing.assert_allclose(contact_point(tip, 0.006, np.zeros(2)), tip)


def test_support_of_a_polygon_tends_to_the_disc():
    a = np.linspace(0, 2 * np.pi, 400)
    ring = 0.006 * np.c_[np.cos(a), np.sin(a)]
    for t in np.linspace(0, 6, 7):
        d = np.array([np.cos(t), np.sin(t)])
        assert Polygon(ring).support_m(d) == pytest.approx(Disc(0.006).support_m(d), rel=1e-4)
    square = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1.0]])
    assert Polygon(square).support_m(np.array([0.6, 0.8])) == pytest.approx(1.4)


@given(turn=st.floats(-np.pi, np.pi), yaw=st.floats(-np.pi, np.pi), x=st.floats(0.005, 0.02), y=st.floats(0.005, 0.02))
def test_fingers_on_a_wall(turn: float, yaw: float, x: float, y: float) -> None:
    """A rectangle of any yaw, brought up to a wall of any direction: the point lies on the wall (mirrored hand)."""
    normal = np.array([np.cos(turn), np.sin(turn)])
    axes = np.array([[np.cos(yaw), np.sin(yaw)], [np.sin(yaw), -np.cos(yaw)]])
    corners = np.array([[x, y], [-x, y], [-x, -y], [x, -y]]) @ axes.T
    reach = float((corners @ normal).max())
    point = section_point(np.zeros(2), Polygon.rectangle(x, y), axes, normal, -normal)
    assert point @ normal == pytest.approx(reach)


def test_invalid_sections_are_refused() -> None:
    with pytest.raises(ParamError):
        Disc(-1.0)
    with pytest.raises(ParamError):
        Polygon(np.zeros((2, 2)))
    with pytest.raises(ParamError):
        Polygon(np.full((3, 2), np.nan))


def test_zero_approach_has_no_direction():
    with pytest.raises(ParamError):
        contact_direction(np.zeros(2), None)
