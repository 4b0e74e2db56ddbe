"""Time profiles against closed forms and against their limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glotouch_bt.motion.timing import ProfileLimits, between, joint_move, rest_to_rest, stop

PERIOD = 0.01
positive = st.floats


def test_long_travel_takes_the_textbook_time() -> None:
    """Seven-segment profile with all phases: T = L/v + v/a + a/j (Biagiotti & Melchiorri 2008, 3.4)."""
    length, v, a, j = 0.5, 0.2, 1.0, 20.0
    profile = rest_to_rest(length, v, a, j, PERIOD)
    assert len(profile.s) == int(np.ceil((length / v + v / a + a / j) / PERIOD - 1e-9))
    assert profile.s[-1] == length
    assert profile.v.max() == pytest.approx(v)


@settings(max_examples=60, deadline=None)
@given(length=positive(1e-4, 1.0), v=positive(0.005, 0.25), a=positive(0.1, 2.0), j=positive(2.0, 200.0))
def test_travel_stays_within_its_limits(length: float, v: float, a: float, j: float) -> None:
    profile = rest_to_rest(length, v, a, j, PERIOD)
    s = np.concatenate([[0.0], profile.s])
    assert np.diff(s).min() >= -1e-12
    assert np.diff(s).max() <= v * PERIOD + 1e-12
    assert np.abs(profile.v).max() <= v + 1e-9
    assert np.abs(profile.a).max() <= a + 1e-9
    assert np.abs(np.diff(profile.a)).max(initial=0.0) <= j * PERIOD + 1e-6
    assert (profile.s[-1], profile.v[-1], profile.a[-1]) == (length, 0.0, 0.0)


@settings(max_examples=200, deadline=None)
@given(
    length=positive(1e-3, 0.5),
    v=positive(0.005, 0.25),
    marks=st.lists(st.tuples(positive(-0.1, 0.6), positive(0.005, 0.25)), max_size=4),
    a=positive(0.1, 2.0),
    j=positive(2.0, 200.0),
    backwards=st.booleans(),
)
def test_paces_hold_where_they_begin_and_are_passed_without_a_stop(
    length: float, v: float, marks: list[tuple[float, float]], a: float, j: float, backwards: bool
) -> None:
    speed_steps = tuple(sorted(marks))
    limits = ProfileLimits(v, a, j, speed_steps)
    ends = (length, 0.0) if backwards else (0.0, length)
    profile = between(*ends, limits, PERIOD)
    s = np.concatenate([[ends[0]], profile.s])
    assert (np.sign(ends[1] - ends[0]) * np.diff(s)).min() >= -1e-9
    allowed = np.full(len(profile.s), v)
    for at, pace in speed_steps:
        allowed[profile.s > at] = pace
    assert (np.abs(profile.v) <= allowed + 1e-6).all()
    assert np.abs(profile.a).max() <= a + 1e-6
    assert (np.abs(profile.v[:-1]) > 0).all()
    assert (profile.s[-1], profile.v[-1], profile.a[-1]) == (ends[1], 0.0, 0.0)


@settings(max_examples=100, deadline=None)
@given(v=positive(0.0, 0.25), share=positive(-1.0, 1.0), a=positive(0.5, 4.0), j=positive(50.0, 400.0))
def test_stop_distance_is_bounded(v: float, share: float, a: float, j: float) -> None:
    """From speed v and acceleration a0: at most v' t' + v'^2/2a + v' a/2j, v' the peak speed, t' the time to reach it.

    While the acceleration falls to zero the speed still rises by a0^2/2j within a0/j. From there the halt is two jerk
    ramps and a plateau: its distance is v'/2 times its duration v'/a + a/j, if a is reached at all.
    """
    a0 = share * min(1.0, a, np.sqrt(2 * j * v))
    profile = stop(0.0, v, a0, a, j, PERIOD)
    up = max(a0, 0.0)
    peak = v + up * up / (2 * j)
    bound = peak * up / j + peak * peak / (2 * a) + peak * a / (2 * j)
    assert profile.s[-1] <= bound + 1e-12
    assert (profile.v[-1], profile.a[-1]) == (0.0, 0.0)


def test_stop_from_cruise_is_the_closed_form() -> None:
    """v, a0 = 0, plateau reached: v^2/2a + v a/2j."""
    v, a, j = 0.04, 2.0, 200.0
    assert stop(0.1, v, 0.0, a, j, PERIOD).s[-1] == pytest.approx(0.1 + v * v / (2 * a) + v * a / (2 * j), abs=1e-12)


def test_joint_move_is_straight_and_within_limits() -> None:
    start, end = np.array([0.0, 1.0, -0.5]), np.array([1.0, 0.4, -0.5])
    velocity, acceleration, jerk = np.array([1.0, 0.5, 1.0]), np.full(3, 2.0), np.full(3, 20.0)
    profile = joint_move(start, end, velocity, acceleration, jerk, PERIOD)
    np.testing.assert_array_equal(profile.q[-1], end)
    np.testing.assert_array_equal(profile.dq[-1], 0.0)
    assert np.all(np.abs(profile.dq).max(axis=0) <= velocity + 1e-9)
    assert np.all(np.abs(profile.ddq).max(axis=0) <= acceleration + 1e-9)
    share = (profile.q[:, 0] - start[0]) / (end[0] - start[0])
    np.testing.assert_allclose(profile.q[:, 1], start[1] + share * (end[1] - start[1]), atol=1e-9)
    np.testing.assert_allclose(np.gradient(profile.q[:, 0], PERIOD)[1:-1], profile.dq[1:-1, 0], atol=1e-3)


@pytest.mark.parametrize("ulps", range(-8, 9))
def test_length_that_just_reaches_full_speed_has_a_profile(ulps: int) -> None:
    """Speed times jerk is exactly the acceleration squared: to full speed and back takes exactly 2 v a / j metres."""
    way = 0.005 + ulps * np.spacing(0.005)
    profile = rest_to_rest(way, 0.05, 1.0, 20.0, PERIOD)
    assert profile.s[-1] == way
    assert np.abs(profile.v).max() <= 0.05 + 1e-9
    assert np.abs(profile.a).max() <= 1.0 + 1e-9
