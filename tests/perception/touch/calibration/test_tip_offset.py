"""Where the ball is in the hand, from walls: simulated touches with a known answer."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glotouch_bt.perception.touch.calibration.tip_offset import WallTouch, solve_tip, wrench_delay
from glotouch_bt.robot import ParamError

RADIUS = 0.006
WALLS = (0.151, 0.1985)
OUT = np.array([[-1.0, 0.0], [0.0, -1.0]])
small = st.floats(-0.005, 0.005)


def touches(error_P, late_s, yaws, *, speeds=(0.015,), noise=None) -> list[WallTouch]:
    """The believed ball centres that two walls give for a hand pointing down at several yaws."""
    found = []
    for yaw in yaws:
        axes = np.array([[np.cos(yaw), np.sin(yaw)], [np.sin(yaw), -np.cos(yaw)]])  # P's x and y in K
        for wall, out in enumerate(OUT):
            for speed in speeds:
                true = np.zeros(2) + (WALLS[wall] - RADIUS) * out
                believed = true - axes @ error_P + late_s * speed * out
                if noise is not None:
                    believed = believed + noise() * out
                found.append(WallTouch(wall, out, believed, axes.T @ out, speed))
    return found


@given(x=small, y=small, late=st.floats(-0.004, 0.006))
def test_tip_is_independent_of_walls_and_latency(x: float, y: float, late: float) -> None:
    """Straight and a quarter turn either way; the latency cancels in the tip, and is found from two speeds."""
    made = touches(np.array([x, y]), late, (0.3, 0.3 + np.pi / 2, 0.3 - np.pi / 2), speeds=(0.01, 0.02))
    found = solve_tip(made, RADIUS, touch_sd_m=1e-6, late_sd_s=1.0)
    np.testing.assert_allclose(found.tip_error_P_m, [x, y], atol=1e-8)
    assert found.late_s == pytest.approx(late, abs=1e-6)
    np.testing.assert_allclose(found.walls_m, WALLS, atol=1e-7)
    assert np.abs(found.residuals_m).max() < 1e-8


@pytest.mark.parametrize("yaws", [(0.0, np.pi / 2, -np.pi / 2), (0.0, np.pi / 2)])
def test_covariance_matches_many_trials(yaws) -> None:
    rng = np.random.default_rng(5)
    sd = 3e-5
    errors, claimed = [], 0.0
    for _ in range(2000):
        made = touches(np.array([1e-3, -5e-4]), 0.0, yaws, noise=lambda: sd * rng.standard_normal())
        found = solve_tip(made, RADIUS, touch_sd_m=sd, late_sd_s=1e-4)
        errors.append(found.tip_error_P_m - (1e-3, -5e-4))
        claimed = found.tip_sd_m
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(claimed, rel=0.06)


def test_tip_is_unknown_from_one_yaw() -> None:
    found = solve_tip(touches(np.array([1e-3, 0]), 0.0, (0.0,)), RADIUS, touch_sd_m=3e-5, late_sd_s=1e-4)
    assert found.tip_sd_m == pytest.approx(0.005, rel=0.01)


def test_invalid_touches_are_refused() -> None:
    made = touches(np.zeros(2), 0.0, (0.0, 1.5))
    with pytest.raises(ParamError):
        solve_tip([], RADIUS, touch_sd_m=1e-5, late_sd_s=1e-4)
    with pytest.raises(ParamError):
        solve_tip([dataclasses.replace(t, wall=t.wall + 1) for t in made], RADIUS, touch_sd_m=1e-5, late_sd_s=1e-4)
    with pytest.raises(ParamError):
        solve_tip(made, RADIUS, touch_sd_m=np.nan, late_sd_s=1e-4)


def shaken(delay_s: float, noise_N: float, rng, n: int = 800) -> tuple[np.ndarray, np.ndarray]:
    """A rise of 40 mm at up to 0.1 m/s, and the wrist force of 0.94 kg behind it."""
    t = np.arange(n) * 1e-3
    ramp = np.clip((t - 0.1) / 0.4, 0.0, 1.0)
    jerk = (2 * np.pi / 0.4) ** 2 * 0.1 * 0.4
    acceleration = np.where((ramp > 0) & (ramp < 1), jerk / (2 * np.pi) * np.sin(2 * np.pi * ramp), 0.0)
    position = 0.04 * (ramp - np.sin(2 * np.pi * ramp) / (2 * np.pi))
    force = -0.94 * np.interp(t - delay_s, t, acceleration) + 0.3
    return position, force + noise_N * rng.standard_normal(n)


@pytest.mark.parametrize("delay_s", [0.001, 0.003, 0.008, 0.015])
def test_known_delay_is_estimated(delay_s: float) -> None:
    position, force = shaken(delay_s, 0.0, np.random.default_rng(0))
    found, _ = wrench_delay(position + 0.6, force, 1000.0)
    assert found == pytest.approx(delay_s, abs=2e-5)


def test_standard_deviation_of_the_delay_matches_its_scatter() -> None:
    rng = np.random.default_rng(1)
    found = np.array([wrench_delay(*shaken(0.005, 0.15, rng), 1000.0, steps=81) for _ in range(60)])
    assert abs(np.mean(found[:, 0]) - 0.005) < 4 * np.std(found[:, 0]) / np.sqrt(60)
    assert np.std(found[:, 0]) == pytest.approx(np.mean(found[:, 1]), rel=0.4)


def test_short_signal_is_refused() -> None:
    with pytest.raises(ParamError):
        wrench_delay(np.zeros(100), np.zeros(100), 1000.0)
    with pytest.raises(ParamError):
        wrench_delay(np.zeros(800), np.zeros(799), 1000.0)
