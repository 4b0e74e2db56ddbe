"""Errors of depth maps against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr

from glotouch_backends.mujoco.axis_proof import AxisProof
from glotouch_backends.mujoco.sensing import DepthErrors
from glotouch_backends.mujoco.sensing.depth import RECOVERY_S, SMOOTH_LENGTH_M
from glotouch_bt.robot import Array, Conditions

WINDOW_M, SHAPE = (0.020, 0.040), (200, 100)
PITCH_M = 0.0002
DEPTH_M = 0.0004


def errors(seed: int = 0, **axes: object) -> DepthErrors:
    conditions = Conditions(name="test", **axes)  # type: ignore[arg-type]
    return DepthErrors(conditions, seed, WINDOW_M, SHAPE, AxisProof(conditions))


def step() -> Array:
    """Both pads pressed by a straight edge: the upper half of the rows is indented."""
    maps = np.zeros((2, *SHAPE))
    maps[:, : SHAPE[0] // 2] = DEPTH_M
    return maps


def felt(model: DepthErrors, maps: Array, now_s: float = 0.0) -> Array:
    model.feel(maps, now_s)
    return model.shown(maps)


def test_an_edge_is_blurred_outside_only() -> None:
    """Beyond a step edge of depth D, a Gaussian of sd s gives D (1 - Phi(r / s)) at the distance r."""
    found = felt(errors(gel_blur_m=0.001), step())
    edge = SHAPE[0] // 2
    assert np.array_equal(found[:, :edge], step()[:, :edge])
    r = (np.arange(SHAPE[0] - edge) + 0.5) * PITCH_M
    np.testing.assert_allclose(found[0, edge:, 50], DEPTH_M * (1.0 - ndtr(r / 0.001)), atol=0.005 * DEPTH_M)


def test_the_gel_bulges_around_a_contact() -> None:
    maps = step()
    found = felt(errors(gel_bulge_fraction=0.05), maps)
    assert np.array_equal(found[maps > 0], maps[maps > 0])
    outside = found[:, SHAPE[0] // 2 :]
    assert -0.05 * DEPTH_M < outside.min() < -0.02 * DEPTH_M  # half of the bulge's height at the edge
    assert np.abs(outside[:, -40:]).max() < 0.001 * DEPTH_M


def test_gain_multiplies_each_pad() -> None:
    found = felt(errors(tactile_gain=(0.85, 1.15)), step())
    left, right = found[0].max() / DEPTH_M, found[1].max() / DEPTH_M
    assert left != right
    assert all(0.85 <= gain <= 1.15 for gain in (left, right))
    np.testing.assert_allclose(found[0], left * step()[0])


def test_hysteresis_is_a_loop_that_closes() -> None:
    """Loading shows d; unloading at once from D shows d + h (D - d); the rest fades with exp(-t / tau)."""
    model, flat = errors(tactile_hysteresis_fraction=0.05), np.ones((2, *SHAPE))
    for d in (0.0001, 0.0002, 0.0004):
        np.testing.assert_allclose(felt(model, d * flat), d)
    for d in (0.0003, 0.0001, 0.0):
        np.testing.assert_allclose(felt(model, d * flat), d + 0.05 * (0.0004 - d))
    np.testing.assert_allclose(felt(model, 0.0 * flat, RECOVERY_S), 0.05 * 0.0004 / math.e)
    assert np.abs(felt(model, 0.0 * flat, 20 * RECOVERY_S)).max() < 1e-12


def test_the_smooth_error_has_its_sd_and_length() -> None:
    """A Gaussian field of covariance sd^2 exp(-r^2 / (2 L^2)); drawn anew when a contact begins or ends."""
    fields, flat = [], np.zeros((2, *SHAPE))
    for seed in range(60):
        model = errors(seed, tactile_smooth_error_sd_m=5e-5)
        fields.append(model.shown(flat).copy())
        assert np.array_equal(model.shown(flat), fields[-1])
        touched = felt(model, step()) - step()
        assert not np.allclose(touched, fields[-1], atol=1e-6)
        np.testing.assert_allclose(felt(model, step(), 1.0) - step(), touched, atol=1e-12)
    drawn = np.concatenate(fields)
    assert drawn.std() == pytest.approx(5e-5, rel=0.05)
    steps = round(SMOOTH_LENGTH_M / PITCH_M)
    together = (drawn[:, steps:] * drawn[:, :-steps]).mean() / (drawn * drawn).mean()
    assert together == pytest.approx(math.exp(-0.5), abs=0.06)


def test_without_axes_a_map_stays_as_it_is() -> None:
    model, maps = errors(), step()
    assert np.array_equal(felt(model, maps), maps)
    assert np.array_equal(felt(model, np.zeros_like(maps), 1.0), np.zeros_like(maps))
