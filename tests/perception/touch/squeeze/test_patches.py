import numpy as np
import pytest
import scipy

from glotouch_bt.perception.touch import pad_noise_m, patch_statistics, relative_nonplanarity
from glotouch_bt.robot import TactileFrame

ROWS, COLS = np.meshgrid(np.arange(35.0), np.arange(20.0), indexing="ij")


def test_plane_has_zero_nonplanarity():
    for slope in ((0, 0), (1e-6, 2e-6), (-3e-6, 1e-6)):
        depth = 4e-4 + slope[0] * ROWS + slope[1] * COLS
        stats = patch_statistics(depth)
        assert stats.valid
        assert stats.rho == pytest.approx(0.0, abs=1e-9)
        assert stats.area_fraction == 1.0
        assert stats.patches == 1


def test_nonplanarity_of_a_sphere():
    """Paraboloid cap d0 (1 - r^2/R^2) on its disc: depth is uniform on [0, d0], so the plane is its mean d0/2, the RMS
    d0/sqrt(12) and the 90th percentile 0.9 d0; rho = 0.3208."""
    y, x = np.meshgrid(np.linspace(-1, 1, 401), np.linspace(-1, 1, 401), indexing="ij")
    depth = 1e-3 * (1 - x**2 - y**2)
    assert relative_nonplanarity(depth, depth > 0) == pytest.approx(1 / np.sqrt(12) / 0.9, rel=0.01)
    coarse = 1e-3 * (1 - ((ROWS - 17) / 12) ** 2 - ((COLS - 9.5) / 9) ** 2)
    assert patch_statistics(np.maximum(coarse, 0)).rho == pytest.approx(0.3208, rel=0.05)


def test_nonplanarity_of_a_cylinder():
    """d0 (1 - t^2), t uniform in [-1, 1]: variance 4/45 d0^2, 90th percentile 0.99 d0."""
    t = np.linspace(-1, 1, 2001)
    depth = np.tile(1e-3 * (1 - t**2), (35, 1))
    want = np.sqrt(4 / 45) / 0.99
    assert relative_nonplanarity(depth, depth >= 0) == pytest.approx(want, rel=0.01)


def test_specks_are_ignored_and_dead_taxels_bridged():
    depth = np.zeros((35, 20))
    depth[5:15, 3:13] = 3e-4
    depth[25, 15] = 5e-4  # a speck
    depth[10, :] = np.nan  # a dead row across the patch does not cut it in two
    stats = patch_statistics(depth)
    assert stats.patches == 1
    assert stats.mask.sum() == 90
    assert stats.area_fraction == pytest.approx(90 / (34 * 20))
    two = np.zeros((35, 20))
    two[2:8, 2:8] = two[20:30, 2:12] = 3e-4
    assert patch_statistics(two).patches == 2


@pytest.mark.parametrize("depth", [np.zeros((35, 20)), np.full((35, 20), np.nan)])
def test_no_contact(depth):
    stats = patch_statistics(depth)
    assert not stats.valid
    assert np.isnan(stats.rho)
    assert stats.area_fraction == 0.0
    noise = np.random.default_rng(0).normal(0, 2e-5, (35, 20))
    assert not patch_statistics(noise).valid


def smooth_noise(seed, sd_m=5e-5):
    """Correlated over 5 mm, as the error of a reconstructed map: a part of a larger field of this deviation."""
    white = np.random.default_rng(seed).standard_normal((95, 80))
    field = scipy.ndimage.gaussian_filter(white, (4.3, 4.1))[20:-20, 20:-20]
    return sd_m * (field / field.std())[10:45, 10:30]


def test_noise_that_was_measured_is_no_contact():
    valid = [patch_statistics(smooth_noise(i), noise_m=5e-5).valid for i in range(100)]
    assert sum(valid) <= 10
    assert sum(patch_statistics(smooth_noise(i)).valid for i in range(100)) > 75


def test_flat_side_is_felt_through_the_noise():
    """10 N on a whole pad indent a nominal gel by 0.1 mm, less than the noise's peaks."""
    maps = [1e-4 + smooth_noise(i) for i in range(100)]
    assert sum(patch_statistics(m, noise_m=5e-5).valid for m in maps) >= 95


def test_noise_of_untouched_pads():
    rng = np.random.default_rng(0)
    smooth = smooth_noise(0)
    frames = [TactileFrame(0.01 * k, smooth + rng.normal(0, 2e-5, (35, 20)), np.zeros((35, 20))) for k in range(9)]
    left, right = pad_noise_m(frames)
    # White noise averages out, smooth noise does not.
    assert left == pytest.approx(np.sqrt(np.mean(smooth**2)), rel=0.05)
    assert right == 0.0
    assert pad_noise_m([]) == (2e-5, 2e-5)
