"""A second height: against the joint normal distribution written out, and its limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch import Candidate, Ring, believe_outline
from glotouch_bt.perception.touch.outline.rings import WANDER, ambiguous, combined, moved, ring_height_m, with_ring
from glotouch_bt.robot import ParamError

R = 0.006
FAR = st.floats(-0.02, 0.02)
SD = st.floats(1e-4, 5e-3)


def touched(radius_m, centre_m=(0.0, 0.0), n=9, wave_m=0.0):
    """What n contacts round a disc say whose radius waves three times round."""
    a = np.linspace(0.0, 2 * np.pi, n, endpoint=False)
    u = np.column_stack([np.cos(a), np.sin(a)])
    tips = np.asarray(centre_m) + (radius_m + R + wave_m * np.cos(3 * a))[:, None] * u
    return believe_outline(tips, R, approach_K=-u, reaction_K=u)


@given(c1=st.tuples(FAR, FAR), c2=st.tuples(FAR, FAR), s1=SD, s2=SD, apart=st.floats(0.005, 0.06))
def test_it_is_the_conditional_mean_of_the_joint_distribution(c1, c2, s1, s2, apart):
    """x the lower middle, w the wander: both sights are linear in (x, w), and weighted least squares has the answer."""
    h = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    weight = np.array([s1, s2, WANDER * apart]) ** -2.0
    solve = np.linalg.inv(h.T @ (weight[:, None] * h))
    y = np.array([c1, c2, (0.0, 0.0)])
    wanted = (solve @ (h.T @ (weight[:, None] * y)))[0]
    centre, covariance = combined(np.array(c1), s1**2 * np.eye(2), np.array(c2), s2**2 * np.eye(2), apart)
    np.testing.assert_allclose(centre, wanted, atol=1e-9)
    np.testing.assert_allclose(covariance, solve[0, 0] * np.eye(2), rtol=1e-6, atol=1e-15)


def test_what_one_height_knows_well_stays_and_what_it_does_not_follows():
    c1, c2, eye = np.zeros(2), np.array([0.004, 0.0]), np.eye(2)
    assert combined(c1, 1e-4**2 * eye, c2, 1e-4**2 * eye, 0.03)[0][0] < 1e-5
    assert combined(c1, 0.01**2 * eye, c2, 1e-4**2 * eye, 0.012)[0][0] > 0.0039


def test_a_disc_is_not_ambiguous_and_what_no_family_explains_is():
    assert ambiguous(touched(0.03)) == ""
    assert "centre is known to" in ambiguous(touched(0.03, n=2))
    a = np.repeat(np.linspace(0.0, 2 * np.pi, 7, endpoint=False), 2)
    u = np.column_stack([np.cos(a), np.sin(a)])
    rough = (0.036 + 0.003 * (-1.0) ** np.arange(14))[:, None] * u  # at one bearing now farther out, now farther in
    assert "off the outline" in ambiguous(believe_outline(rough, R, approach_K=-u, reaction_K=u))


@pytest.mark.parametrize(
    ("top", "height"), [(0.10, 0.06), (0.045, 0.030), (0.060, 0.036), (0.041, 0.030), (0.039, None), (0.018, None)]
)
def test_the_height_keeps_clear_of_the_top_and_of_the_first_ring(top, height):
    found = ring_height_m(top, 0.018, 0.6, 0.012, 0.010)
    assert found == (None if height is None else pytest.approx(height))


def test_the_outline_moves_as_a_whole():
    for belief in (touched(0.03), touched(0.03, n=12, wave_m=0.004)):
        by = np.array([0.01, -0.02])
        there = moved(belief.contour, by)
        np.testing.assert_allclose(there.outline_K_m(), belief.contour.outline_K_m() + by, atol=1e-12)
        assert there.size_m == belief.contour.size_m


def test_the_candidate_keeps_what_was_felt_at_which_height():
    lower, upper = touched(0.03, n=5), touched(0.02, (0.004, 0.0))
    ring = Ring(0.045, upper.contour, ())
    before = Candidate(3, lower.contour, 0.06, 0.7, ())
    after = with_ring(before, lower, ring, upper, 0.018)
    assert after.rings == (ring,)
    assert 0.0 < after.contour.centre_K_m[0] < 0.004
    assert (after.index, after.height_m, after.contour.size_m) == (3, 0.06, lower.contour.size_m)
    with pytest.raises(ParamError, match="another height"):
        with_ring(before, lower, ring, upper, 0.045)
