"""The gel against closed forms; patches and pooling."""

import numpy as np
import pytest

from glotouch_bt.perception.recognition.model.pads import PadSpec, gel_shift, image_feature, patch_of, pool
from glotouch_bt.perception.recognition.model.simulated_touches import pooled_images
from glotouch_bt.robot import ParamError

PAD = PadSpec()
CELL = PAD.window_m[0] * PAD.window_m[1] / 700


def test_flat_wall_sinks_by_the_gel_law() -> None:
    area = 700 * CELL
    s = float(gel_shift(np.zeros(700), CELL, 10.0, PAD)[0])
    assert PAD.stiffness_N_m3 * s / (1 - (s / PAD.limit_m) ** 2) * area == pytest.approx(10.0, rel=0.02)


def test_sphere_balances_ten_newtons() -> None:
    """Linear Winkler foundation under a sphere: F = pi k R s^2; here with a gel that is nearly linear."""
    soft = PadSpec(limit_m=1.0, depth_m=1.5e-3)
    x = np.linspace(-8.6e-3, 8.6e-3, 201)
    u, v = np.meshgrid(x, x)
    h = -(u**2 + v**2) / (2 * 0.030)
    s = float(gel_shift(h.ravel(), (x[1] - x[0]) ** 2, 10.0, soft)[0])
    assert s == pytest.approx(np.sqrt(10.0 / (np.pi * soft.stiffness_N_m3 * 0.030)), rel=0.01)


def test_fast_images_agree_with_the_gel() -> None:
    l = (np.arange(15) - 7) * PAD.window_m[0] / 15
    z = (np.arange(21) - 10) * PAD.window_m[1] / 21
    h = (-(l[:, None] ** 2) / 0.06 - z[None, :] ** 2 / 0.2).astype(np.float32)
    fast = pooled_images(h[None], 2, PAD)[0, 0, 0]
    cell = PAD.window_m[0] * PAD.window_m[1] / 315
    s = gel_shift(h.reshape(-1).astype(float) - h.max(), cell, PAD.force_N, PAD)
    exact = pool(np.clip(h - h.max() + s, 0, None).astype(float).T[::-1])
    np.testing.assert_allclose(fast, exact, atol=2e-5)


def test_pool_rows_run_down_and_dead_taxels_are_left_out() -> None:
    d = np.zeros((35, 20))
    d[:5, :4] = 1e-3
    assert pool(d).reshape(7, 5)[0, 0] == pytest.approx(1e-3)
    assert pool(d).sum() == pytest.approx(1e-3)
    d[0, 0] = np.nan
    assert pool(d).reshape(7, 5)[0, 0] == pytest.approx(1e-3)
    assert np.isfinite(pool(np.full((35, 20), np.nan))).all()
    with pytest.raises(ParamError):
        pool(np.zeros((3, 3)))


def test_feature_is_monotone() -> None:
    f = image_feature(np.linspace(0, 1.5e-3, 50))
    assert f[0] == 0
    assert (np.diff(f) > 0).all()


def test_patch_of_a_tilted_plane_is_planar_and_of_a_ridge_is_not() -> None:
    r, c = np.mgrid[0:35, 0:20]
    plane = patch_of(2e-4 + 1e-5 * r + 5e-6 * c, PAD)
    assert plane.valid
    assert plane.rho < 0.01
    ridge = patch_of(np.maximum(1e-3 - 2.5e-4 * np.abs(c - 9.5), 0.0), PAD)
    assert ridge.rho > 0.2


def test_noise_alone_is_no_contact() -> None:
    noise = np.clip(np.random.default_rng(1).normal(0, 5e-5, (35, 20)), 0, None)
    assert not patch_of(noise, PAD).valid
    assert not patch_of(np.full((35, 20), np.nan), PAD).valid
