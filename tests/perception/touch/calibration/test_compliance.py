"""The probe's compliance from presses of a wall, against springs whose compliance is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch.calibration import Press, solve_compliance
from glotouch_bt.robot import ParamError

give = st.floats(0.0, 5e-3)


def press(yaw_rad: float, compliance: np.ndarray, force_N: float, gain: float = 1.0) -> Press:
    """A frictionless wall presses a spring: the advance is n C n times the force, of which the wrist reads `gain`."""
    n = np.array([np.cos(yaw_rad), np.sin(yaw_rad)])
    return Press(n, float(n @ np.diag(compliance) @ n) * force_N, gain * force_N)


@given(about=give, across=give, yaw=st.floats(-0.5, 0.5), force=st.floats(0.3, 6.0))
def test_two_directions_give_both_axes(about, across, yaw, force) -> None:
    true = np.array([about, across])
    found = solve_compliance([press(yaw, true, force), press(yaw + np.pi / 2, true, 0.7 * force)])
    np.testing.assert_allclose(found, true, atol=1e-9)


def test_more_presses_are_averaged() -> None:
    true = np.array([2e-3, 3e-4])
    presses = [press(a, true * s, 2.0) for a, s in ((0.0, 1.1), (np.pi, 0.9), (np.pi / 2, 1.1), (-np.pi / 2, 0.9))]
    np.testing.assert_allclose(solve_compliance(presses), true, rtol=1e-9)


@pytest.mark.parametrize("gain", [0.9, 1.0, 1.1])
def test_the_wrists_gain_cancels_in_the_deflection(gain) -> None:
    """Compliance times measured force is the true deflection, though neither factor is known."""
    true = np.array([2e-3, 3e-4])
    found = solve_compliance([press(0.0, true, 2.0, gain), press(np.pi / 2, true, 2.0, gain)])
    np.testing.assert_allclose(found * (gain * 1.3), true * 1.3, rtol=1e-12)


def test_an_advance_backwards_is_no_compliance() -> None:
    presses = [Press(np.array([1.0, 0.0]), -1e-6, 2.0), Press(np.array([0.0, 1.0]), 4e-4, 2.0)]
    np.testing.assert_allclose(solve_compliance(presses), [0.0, 2e-4], atol=1e-12)


@pytest.mark.parametrize("yaws", [(0.0,), (0.0, np.pi), (0.7, 0.7), (np.pi / 4, 3 * np.pi / 4), ()])
def test_one_direction_does_not_tell_the_axes_apart(yaws) -> None:
    """At 45 degrees to the axes, all four directions measure the mean of both."""
    with pytest.raises(ParamError, match="two directions"):
        solve_compliance([press(a, np.array([2e-3, 3e-4]), 2.0) for a in yaws])


@pytest.mark.parametrize("force", [0.0, -1.0, float("nan")])
def test_a_press_needs_a_force(force) -> None:
    with pytest.raises(ParamError, match="force_N"):
        solve_compliance([Press(np.array([1.0, 0.0]), 1e-3, force), Press(np.array([0.0, 1.0]), 1e-3, 1.0)])
